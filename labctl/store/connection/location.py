"""How a database is named: the path of an SQLite file, or a URL."""

from __future__ import annotations

import re
from pathlib import Path
from urllib.parse import urlsplit


def is_url(location: str) -> bool:
    """Return whether a database is named by URL; otherwise it is the path of an SQLite file."""
    return "://" in location


def shown(location: str) -> str:
    """Return a database's path or URL as it may be printed: without its password."""
    return re.sub(r"(://[^/?#:@]*):.*@", r"\1:***@", location)


def database_name(location: str) -> str:
    """Return the name of a database alone: neither its folder or host nor a password."""
    return Path(urlsplit(location).path if is_url(location) else location).name
