"""One database, one writer. SQLite in a file by default; the same statements run on PostgreSQL.

SQLite before 3.51.3 can damage a write-ahead log when two connections write at once, so exactly one connection of one
process writes: a lock beside the file holds everybody to it, and a note beside the lock says who it is.
"""

from __future__ import annotations

import json
import os
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from filelock import FileLock, Timeout
from sqlalchemy.exc import DatabaseError
from sqlalchemy.pool import StaticPool

from labctl.errors import BadInput, Conflict, DiskFull, StoreError
from labctl.store import migrate
from labctl.store.connection.commit_counter import count_commit, missing, seal

BUSY_MS = 5000
#: What SQLite and PostgreSQL call a full disk.
SQLITE_FULL, POSTGRESQL_DISK_FULL = 13, "53100"


@dataclass(frozen=True)
class Holder:
    """Who writes to a database now."""

    pid: int
    url: str | None  #: of the service, where the holder is one
    campaign: int | None = None  #: that runs in the holder's terminal, where the holder is no service


def _held_by(holder: Holder) -> str:
    if holder.campaign is not None:
        return (
            f"campaign {holder.campaign} runs in process {holder.pid}'s terminal: Ctrl-C there ends it safely; a "
            "campaign under `labctl serve` can be paused and aborted from here. Anything else waits for its end"
        )
    who = f"the service at {holder.url}" if holder.url else f"another labctl (process {holder.pid})"
    return f"{who} writes to this database now; wait for it, or ask it"


def is_url(location: str) -> bool:
    """Return whether a database is named by URL; otherwise it is the path of an SQLite file."""
    return "://" in location


def holder_of(location: str) -> Holder | None:
    """Return who holds a database file for writing; None when nobody does."""
    if is_url(location):
        return None
    lock = FileLock(_lock_path(location))
    try:
        with lock.acquire(timeout=0):
            return None
    except Timeout:
        return _read_note(location)


def _lock_path(location: str) -> str:
    return f"{location}.lock"


def _note_path(location: str) -> Path:
    return Path(f"{location}.holder")


def _read_note(location: str) -> Holder:
    try:
        note = json.loads(_note_path(location).read_text(encoding="utf-8"))
        return Holder(int(note["pid"]), note["url"], note.get("campaign"))
    except (OSError, ValueError, KeyError):
        return Holder(0, None)


def note_campaign(location: str, campaign: int) -> None:
    """Say beside a database that this process holds it for a campaign; other processes can tell people so."""
    if is_url(location):
        return
    with suppress(OSError):  # a disk that is full: nobody needs the note
        note = {"pid": os.getpid(), "url": None, "campaign": campaign}
        _note_path(location).write_text(json.dumps(note), encoding="utf-8")


def shown(location: str) -> str:
    """Return a database's path or URL as it may be printed: without its password."""
    return re.sub(r"(://[^/?#:@]*):.*@", r"\1:***@", location)


def _engine_of(url: str) -> sa.Engine:
    """Return an engine for a database that is named by URL. Raises BadInput for one that is not known here."""
    known = "name the path of an SQLite file, or postgresql+psycopg://user:password@host/name"
    try:
        if sa.make_url(url).get_backend_name() == "postgresql":
            return sa.create_engine(url)
    except (sa.exc.ArgumentError, ValueError):  # ValueError: a port that is no number
        pass
    except ModuleNotFoundError as error:
        raise BadInput(
            f"--database {shown(url)}: {error.name} is not installed here: `pip install 'labctl[postgresql]'`; {known}"
        ) from error
    raise BadInput(f"--database {shown(url)}: no database that labctl knows; {known}")


class Database:
    """A migrated database. `write` holds it for this process; without, only `reading` may be used.

    `as_it_is` looks at a database without making or migrating it: there may be nothing, or anything.
    """

    def __init__(self, location: str, *, write: bool, url: str | None = None, as_it_is: bool = False) -> None:
        self.location, self._shown = location, shown(location)
        self.writes = write
        self._guard = threading.RLock()
        self._lock: FileLock | None = None
        self._sqlite = not is_url(location)
        self._synced = True
        if self._sqlite and not as_it_is:
            Path(location).parent.mkdir(parents=True, exist_ok=True)
        if write:
            self._hold(url)
        elif self._sqlite and not Path(location).exists():
            if as_it_is:
                raise StoreError(f"{location}: there is no such file; name the database with --database")
            Database(location, write=True).close()
        try:
            if write and self._sqlite and not Path(location).exists():
                self._refuse_loss(None)
            self._engine = self._make_engine(write=write)
            if not as_it_is:
                self._migrate(write=write)
            #: Reading has connections of its own: it neither waits for the writer nor makes it wait.
            self._reader = self._make_engine(write=False) if write and self._sqlite else self._engine
        except BaseException:
            self._release()
            raise

    def _hold(self, url: str | None) -> None:
        if not self._sqlite:
            return
        self._lock = FileLock(_lock_path(self.location))
        try:
            self._lock.acquire(timeout=0)
        except Timeout:
            self._lock = None
            holder = _read_note(self.location)
            raise Conflict(f"{self.location}: {_held_by(holder)}") from None
        try:
            self.announce(url)
        except OSError:
            self._release()
            raise

    def announce(self, url: str | None) -> None:
        """Say at which address this process can be asked to write."""
        if self._lock is not None:
            _note_path(self.location).write_text(json.dumps({"pid": os.getpid(), "url": url}), encoding="utf-8")

    def _make_engine(self, *, write: bool) -> sa.Engine:
        if not self._sqlite:
            return _engine_of(self.location)
        options: dict[str, Any] = {"poolclass": StaticPool} if write else {}
        engine = sa.create_engine(
            f"sqlite:///{self.location}",
            connect_args={"check_same_thread": False, "timeout": BUSY_MS / 1000},
            **options,
        )

        @sa.event.listens_for(engine, "connect")
        def prepare(connection: Any, _: Any) -> None:
            connection.isolation_level = None  # transactions are begun below, never by the driver's guess
            for pragma in (
                f"busy_timeout={BUSY_MS}",
                "foreign_keys=ON",
                *(("journal_mode=WAL", "synchronous=FULL") if write else ("query_only=ON",)),
            ):
                connection.execute(f"PRAGMA {pragma}")

        @sa.event.listens_for(engine, "begin")
        def begin(connection: sa.Connection) -> None:
            connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")

        return engine

    def _migrate(self, *, write: bool) -> None:
        try:
            with self._engine.connect() as connection:
                if write:
                    self._refuse_loss(connection)
                found = migrate.revision_of(connection)
            if found == migrate.HEAD:
                return
            migrate.refuse_unknown(found, self._shown)
            if not write:
                Database(self.location, write=True).close()
                return
            with self._engine.begin() as connection:
                migrate.upgrade(connection)
        except DatabaseError as error:
            raise StoreError(
                f"{self._shown}: not a labctl database, or damaged ({error.orig}); "
                "restore a backup, or name another file with --database"
            ) from error

    def _refuse_loss(self, connection: sa.Connection | None) -> None:
        """Raise StoreError when commits are missing: nobody goes on writing in an archive that lost some."""
        if self._sqlite and (text := missing(connection, self.location)):
            raise StoreError(f"{self.location}: {text}")

    @contextmanager
    def writing(self, *, synced: bool = True) -> Iterator[sa.Connection]:
        """Give the one writing connection inside a transaction: all of it is kept, or nothing.

        What is not `synced` outlives this process at once, but a power cut only when the next synced transaction ends:
        a log is written in order, so that one carries all before it to the disk.
        """
        counted = synced and self._sqlite
        with self._guard:
            try:
                self._sync(synced)
                with self._engine.begin() as connection:
                    yield connection
                    commits = count_commit(connection) if counted else 0
            except sa.exc.DatabaseError as error:
                if isinstance(error, sa.exc.IntegrityError | sa.exc.ProgrammingError):
                    raise
                raise self._trouble(error) from error
            if counted:
                seal(self.location, commits)

    def _trouble(self, error: sa.exc.DatabaseError) -> StoreError:
        full = getattr(error.orig, "sqlite_errorcode", None) == SQLITE_FULL
        if full or getattr(error.orig, "sqlstate", None) == POSTGRESQL_DISK_FULL:
            cause = f"{self._shown}: the disk is full"
            return DiskFull(f"{cause}; nothing of this act was kept. Make room, then go on", cause=cause)
        cause = f"{self._shown}: {error.orig}"
        return StoreError(f"{cause}; nothing of this act was kept", cause=cause)

    def _sync(self, synced: bool) -> None:
        if not self._sqlite or synced == self._synced:
            return
        driver = self._engine.raw_connection()
        try:
            driver.cursor().execute(f"PRAGMA synchronous={'FULL' if synced else 'NORMAL'}")
        finally:
            driver.close()
        self._synced = synced

    @contextmanager
    def reading(self) -> Iterator[sa.Connection]:
        """Give a connection to read with."""
        try:
            with self._reader.connect() as connection:
                yield connection
        except sa.exc.DatabaseError as error:
            raise StoreError(f"{self._shown}: {error.orig}") from error

    def close(self) -> None:
        """Close the database and let the next writer in."""
        self._reader.dispose()
        self._engine.dispose()
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            _note_path(self.location).unlink(missing_ok=True)
            self._lock.release()
            self._lock = None
