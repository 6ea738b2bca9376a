"""How a database is named: the path of an SQLite file, or a URL."""

from __future__ import annotations

import re


def is_url(location: str) -> bool:
    """Return whether a database is named by URL; otherwise it is the path of an SQLite file."""
    return "://" in location


def shown(location: str) -> str:
    """Return a database's path or URL as it may be printed: without its password."""
    return re.sub(r"(://[^/?#:@]*):.*@", r"\1:***@", location)
