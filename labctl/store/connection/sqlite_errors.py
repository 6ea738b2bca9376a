"""What errors of SQLite mean: the same for a file that is written and for one that is only read."""

from __future__ import annotations

import sqlite3

from sqlalchemy import exc


class SqliteErrors:
    """Says of an error whether the database is away, its disk is full, and what else is to be said."""

    def is_unreachable(self, error: exc.DatabaseError) -> bool:  # noqa: ARG002
        """Return False: every error is about the file itself."""
        return False

    def is_disk_full(self, error: exc.DatabaseError) -> bool:
        """Return whether SQLite says SQLITE_FULL."""
        return getattr(error.orig, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL

    def words_for(self, error: exc.DatabaseError) -> str:  # noqa: ARG002
        """Return an empty text: SQLite's own message is enough."""
        return ""
