"""What errors of SQLite mean: the same for a file that is written and for one that is only read."""

from __future__ import annotations

import sqlite3

from sqlalchemy import exc

from labctl.store.connection.backend import Backend


class SqliteBackend(Backend):
    """A database in a file: every error is about the file itself, and SQLite's own message is enough."""

    def is_disk_full(self, error: exc.DatabaseError) -> bool:
        """Return whether SQLite says SQLITE_FULL."""
        return getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL
