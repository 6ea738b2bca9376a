"""An SQLite database as a file: one writing process, private files, and a file that is not lost, interrupted or
replaced.

SQLite before 3.51.3 can damage a write-ahead log when two connections write at once, so exactly one connection of one
process writes; `writer_lock` enforces it.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy import event as sa_event

from labctl.errors import StoreError
from labctl.store.connection.anchor_file import anchor_fits, write_anchor
from labctl.store.connection.commit_seal import count_commit, missing, seal
from labctl.store.connection.engines import sqlite_engine
from labctl.store.connection.private_files import close_to_others, make_private
from labctl.store.connection.sqlite_backend import SqliteBackend
from labctl.store.connection.writer_lock import ServiceAddress, WriterLock
from labctl.store.manifests.chain import ChainHead

# Which file a database is: one that was deleted or replaced below a running process is not written to any more.
#
# SQLite goes on writing into a file that has no name any more, and reports success. So the writer remembers device and
# inode of the database and, as soon as it is there, of its write-ahead log, and compares them before every commit: two
# system calls, some microseconds.

Identity = tuple[int, int]


def identity_of(path: str) -> Identity | None:
    """Return device and inode of what a path names; None where there is nothing."""
    try:
        file_status = os.stat(path)  # noqa: PTH116  before every commit: a Path costs several times as much
    except OSError:
        return None
    return file_status.st_dev, file_status.st_ino


class FileIdentity:
    """The files of one open SQLite database."""

    def __init__(self, location: str) -> None:
        """Remember the database; it has to be there."""
        self._paths = (str(location), f"{location}-wal")
        self._known = [identity_of(path) for path in self._paths]

    def forget_log(self) -> None:
        """Note that the writing connection is opened anew, and perhaps the log with it."""
        self._known[1] = None

    def changed(self) -> str:
        """Return what has become of the files since they were opened; empty while they are the same.

        The log is remembered when it is there for the first time. It stays for as long as a connection is open.
        """
        for index, path in enumerate(self._paths):
            known_identity, now = self._known[index], identity_of(path)
            if known_identity is None:
                self._known[index] = now
            elif known_identity != now:
                was = "deleted" if now is None else "replaced by another file"
                return (
                    f"{self._paths[0]}: {Path(path).name} was {was} while this process had it open; labctl writes "
                    "nothing more. Stop this process, put the file or the newest backup there, check it with "
                    "`labctl check`, and start again"
                )
        return ""


# The check of an SQLite file before this process writes to it: a damaged one is refused, not damaged further.
#
# `PRAGMA quick_check` reads every page: 1 GB of readings takes 1 to 2 s from memory and 12 to 30 s from a busy disk,
# and a bench waits for its safe state meanwhile. Blocks of readings are nearly all of a large file, and each has a
# checksum of its own that is compared whenever it is read. So a large file is checked without them; `labctl check`
# reads all.

#: Up to this size every page is checked: some 0.1 s.
WHOLE_UP_TO_BYTES = 64 << 20
READINGS = "sample_blocks"


def first_damage(connection: sa.Connection) -> str:
    """Return the first damage that is found; empty for none. Raises DatabaseError for a file that cannot be read."""
    pages = int(connection.exec_driver_sql("PRAGMA page_count").scalar_one())
    page_bytes = int(connection.exec_driver_sql("PRAGMA page_size").scalar_one())
    if pages * page_bytes <= WHOLE_UP_TO_BYTES:
        return _damage(connection, "PRAGMA quick_check(1)")
    names = connection.exec_driver_sql("SELECT name FROM sqlite_schema WHERE type = 'table' ORDER BY name").scalars()
    damages = (_damage(connection, f"PRAGMA quick_check('{name}')") for name in names.all() if name != READINGS)
    return next(filter(None, damages), "")


def _damage(connection: sa.Connection, check: str) -> str:
    text = str(connection.exec_driver_sql(check).scalar() or "ok")
    return "" if text == "ok" else " ".join(text.split())


class SqliteFile(SqliteBackend):
    """The backend of a database by path. With `address` it is held for writing, by a process that is reached there."""

    def __init__(self, location: str, address: ServiceAddress | None) -> None:
        """Take the lock where it is held for writing. Raises Conflict, OSError, and StoreError for a lost file."""
        self._location = location
        self._lock = None if address is None else WriterLock(location, address)
        self._identity: FileIdentity | None = None
        self._synced = True
        self.anchor_fits = True  #: a chain that does not fit its anchor leaves it as it is, for the check to find
        try:
            if self._lock is not None and not Path(location).exists():
                self._refuse_loss(None)
            self._make_private()
        except BaseException:
            self.close()
            raise

    def engines(self) -> tuple[sa.Engine, sa.Engine]:
        """Return two engines: a reader has connections of its own, and neither waits for the writer nor delays it."""
        if self._lock is None:
            engine = sqlite_engine(self._location, write=False)
            return engine, engine
        return sqlite_engine(self._location, write=True), sqlite_engine(self._location, write=False)

    def before_opening(self, connection: sa.Connection) -> None:
        """Refuse a file that lost commits, or whose pages do not fit together."""
        if self._lock is None:
            return
        self._refuse_loss(connection)
        if text := first_damage(connection):
            raise StoreError(
                f"{self._location}: the database is damaged ({text}); nothing was changed. Run `labctl check` "
                "for a list of the damage, then restore the newest backup, or save the readable part with "
                "`sqlite3 FILE .recover`"
            )

    def opened(self, engine: sa.Engine) -> None:
        """Remember the files; from now on others that take their place are not written to."""
        if self._lock is None:
            return
        self._make_private()
        self.anchor_fits = anchor_fits(engine, self._location)
        self._identity = identity = FileIdentity(self._location)
        for event in ("connect", "close"):  # an interrupt inside a write opens the connection anew
            sa_event.listen(engine, event, lambda *_: identity.forget_log())

    def _make_private(self) -> None:
        """Restrict the files of the database to their owner; SQLite makes its log as it finds the database."""
        if self._lock is None:
            return
        make_private(Path(self._location))
        close_to_others(*(Path(f"{self._location}{end}") for end in ("", "-wal", "-shm", ".lock", ".seal", ".anchor")))

    def _refuse_loss(self, connection: sa.Connection | None) -> None:
        """Raise StoreError when commits are missing: nothing is written to an archive that lost some."""
        if text := missing(connection, self._location):
            raise StoreError(f"{self._location}: {text}")

    def refuse_other(self) -> None:
        """Raise StoreError when the database was deleted or replaced since it was opened."""
        if self._identity is not None and (text := self._identity.changed()):
            raise StoreError(f"{text}. Nothing was stored; try again", cause=text)

    def before_begin(self, engine: sa.Engine, *, synced: bool) -> None:
        """Make the next commits reach the disk before they return, or with a later one: the log is written in order."""
        if synced == self._synced:
            return
        driver = engine.raw_connection()
        try:
            driver.cursor().execute(f"PRAGMA synchronous={'FULL' if synced else 'NORMAL'}")
        finally:
            driver.close()
        self._synced = synced

    def before_commit(self, connection: sa.Connection, *, synced: bool) -> int:
        """Count a synced commit, in the file that was opened and no other."""
        self.refuse_other()
        return count_commit(connection) if synced else 0

    def committed(self, commits: int) -> None:
        """Count it in the seal too."""
        if commits:
            seal(self._location, commits)

    def grown(self, head: ChainHead) -> None:
        """Note it in the anchor file, which is outside the database."""
        if self.anchor_fits:
            write_anchor(self._location, head)

    def note_address(self, address: ServiceAddress) -> None:
        """Write the address into the note beside the file."""
        if self._lock is not None:
            with suppress(OSError):  # a full disk: the note is only a hint
                self._lock.note(address)

    def close(self) -> None:
        """Release the writer's lock."""
        self._identity = None  # the log goes with the last connection
        if self._lock is not None:
            self._lock.release()
            self._lock = None
