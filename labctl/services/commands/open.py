"""The store to read from: all that a command begins with which changes nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from labctl.config import default_database
from labctl.store import Store, open_store


@contextmanager
def open_readonly(database: str | None) -> Iterator[Store]:
    """Give the store to read from, also while another process writes."""
    with open_store(database or default_database(), write=False) as store:
        yield store
