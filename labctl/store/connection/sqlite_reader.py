"""An SQLite file that this process may only read: beside the process that writes it, as a copy, or on a read-only disk.

A database in the mode WAL is read through two files beside it. Where the folder may not be written and neither is
there, SQLite can only read a file that it takes for immutable (sqlite.org/wal.html, 6; sqlite.org/uri.html, 3.4). Such
a file is compared before and after each reading: what was changed meanwhile is refused, and the next reads it anew.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote

import sqlalchemy as sa

from labctl.errors import StoreError
from labctl.store.connection.engines import sqlite_reading_engine
from labctl.store.connection.sqlite_backend import SqliteBackend


class FileState(NamedTuple):
    """What tells whether a file has changed."""

    device: int
    inode: int
    size: int
    changed_ns: int
    is_immutable: bool  #: whether SQLite is made to take the file for one that does not change


class SqliteReader(SqliteBackend):
    """The backend of a database by path that is only read: no lock, no note and no file is made beside it."""

    def __init__(self, location: str) -> None:
        """Raise StoreError for a file that is not there."""
        self._location = location
        if not Path(location).is_file():
            raise StoreError(
                f"{location}: there is no such file, and a service that only reads makes none; name the database with "
                "--database"
            )
        self._state = self._file_state()
        self._engine = sqlite_reading_engine(self._uri)

    def _uri(self) -> str:
        """Return how the file is opened now."""
        return f"file:{quote(self._location)}?mode=ro" + ("&immutable=1" if self._is_immutable() else "")

    def _is_immutable(self) -> bool:
        """Return whether SQLite could not read the file in any other way."""
        if os.access(Path(self._location).absolute().parent, os.W_OK):
            return False
        log, shared = Path(f"{self._location}-wal"), Path(f"{self._location}-shm")
        return not log.exists() or (log.stat().st_size == 0 and not shared.exists())

    def _file_state(self) -> FileState:
        try:
            file = Path(self._location).stat()
        except OSError as error:
            raise StoreError(
                f"{self._location}: the database cannot be read ({error.strerror}); put it there again"
            ) from error
        return FileState(file.st_dev, file.st_ino, file.st_size, file.st_mtime_ns, self._is_immutable())

    def engines(self) -> tuple[sa.Engine, sa.Engine]:
        """Return the engine that reads, twice."""
        return self._engine, self._engine

    def refuse_other(self) -> None:
        """Open the file anew where another one has taken its place, or where its log has come or gone.

        Raises StoreError for a file that is gone.
        """
        state, before = self._file_state(), self._state
        is_same = state[:2] == before[:2] and state.is_immutable == before.is_immutable
        if not is_same or (state.is_immutable and state != before):
            self._state = state
            self._engine.dispose()

    @contextmanager
    def unchanged(self) -> Iterator[None]:
        """Raise StoreError at the end of the block where a file that is taken for immutable has changed meanwhile."""
        before = self._file_state()
        yield
        if before.is_immutable and self._file_state()[:4] != before[:4]:
            raise StoreError(f"{self._location}: the database was changed while it was read; ask again")
