"""Real gyros: what labctl says of every public recording here, beside analyses without labctl and beside its peers."""

from __future__ import annotations


def run() -> str:
    """Return the tables as text."""
    from studies.real.page import tables

    return tables()
