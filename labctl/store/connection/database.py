"""One database, one writer. SQLite in a file by default; the same statements run on PostgreSQL.

SQLite before 3.51.3 can damage a write-ahead log when two connections write at once, so exactly one connection of one
process writes; `writer_lock` enforces it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Protocol

import sqlalchemy as sa
from sqlalchemy import event as sa_event
from sqlalchemy import exc
from sqlalchemy.exc import DatabaseError

from labctl.errors import DiskFull, StoreError
from labctl.store import migrate
from labctl.store.connection.commit_seal import count_commit, missing, seal
from labctl.store.connection.engines import make_engine
from labctl.store.connection.file_identity import FileIdentity
from labctl.store.connection.location import is_url, shown
from labctl.store.connection.private_files import close_to_others, make_private
from labctl.store.connection.start_check import first_damage
from labctl.store.connection.writer_lock import NO_SERVICE, ServiceAddress, WriterLock
from labctl.store.connection.writer_turn import WriterTurn

#: What SQLite and PostgreSQL call a full disk.
SQLITE_FULL, POSTGRESQL_DISK_FULL = 13, "53100"


class Writer(Protocol):
    """The process that writes, as another one reaches it."""

    def run(self, name: str, args: tuple[object, ...], kwargs: Mapping[str, object]) -> object:
        """Run the transaction of this name there; returns or raises what it did."""
        ...


class Database:
    """A migrated database. `write` holds it for this process; without, only `reading` may be used.

    `writer` runs the transactions of a process that does not hold it. `address` is written into the note that tells
    other processes who holds it.

    `as_it_is` opens a database without making or migrating it: the file may be of any kind.
    """

    def __init__(
        self,
        location: str,
        *,
        write: bool,
        address: ServiceAddress = NO_SERVICE,
        writer: Writer | None = None,
        as_it_is: bool = False,
    ) -> None:
        self.location, self._shown = location, shown(location)
        self.writes = write
        self.writer = writer
        self._turn = WriterTurn(self._shown)
        self._lock: WriterLock | None = None
        self._sqlite = not is_url(location)
        self._synced = True
        self._identity: FileIdentity | None = None
        if self._sqlite and not as_it_is:
            Path(location).parent.mkdir(parents=True, exist_ok=True)
        if write and self._sqlite:
            self._lock = WriterLock(location, address)
        elif self._sqlite and not Path(location).exists():
            if as_it_is:
                raise StoreError(f"{location}: there is no such file; name the database with --database")
            Database(location, write=True).close()
        try:
            if write and self._sqlite and not Path(location).exists():
                self._refuse_loss(None)
            self._make_private()
            self._engine = make_engine(location, write=write)
            if not as_it_is:
                self._migrate(write=write)
            #: Reading has connections of its own: it neither waits for the writer nor makes it wait.
            self._reader = make_engine(location, write=False) if write and self._sqlite else self._engine
            self._make_private()
            self._remember_files()
        except BaseException:
            self._release()
            raise

    def _make_private(self) -> None:
        """Give the files of the database to their owner alone; SQLite makes its log as it finds the database."""
        if self._lock is None:
            return
        make_private(Path(self.location))
        close_to_others(*(Path(f"{self.location}{end}") for end in ("", "-wal", "-shm", ".lock", ".seal")))

    def _remember_files(self) -> None:
        if self._lock is None:
            return
        self._identity = identity = FileIdentity(self.location)
        for event in ("connect", "close"):  # an interrupt inside a write opens the connection anew
            sa_event.listen(self._engine, event, lambda *_: identity.forget_log())

    def _migrate(self, *, write: bool) -> None:
        try:
            with self._engine.connect() as connection:
                if write:
                    self._refuse_loss(connection)
                    self._refuse_damage(connection)
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
            if (full := self._trouble(error)) and isinstance(full, DiskFull):
                raise full from error
            raise StoreError(
                f"{self._shown}: not a labctl database, or damaged ({error.orig}); "
                "restore a backup, or name another file with --database"
            ) from error

    def _refuse_loss(self, connection: sa.Connection | None) -> None:
        """Raise StoreError when commits are missing: nothing is written to an archive that lost some."""
        if self._sqlite and (text := missing(connection, self.location)):
            raise StoreError(f"{self.location}: {text}")

    def _refuse_damage(self, connection: sa.Connection) -> None:
        """Raise StoreError for a file whose pages do not fit together."""
        if self._sqlite and (text := first_damage(connection)):
            raise StoreError(
                f"{self.location}: damaged ({text}); nothing was changed. Restore the newest backup, or save what can "
                "be read with `sqlite3 FILE .recover`; `labctl check` lists what is found"
            )

    def _refuse_other_file(self) -> None:
        """Raise StoreError when the database was deleted or replaced since it was opened."""
        if self._identity is not None and (text := self._identity.changed()):
            raise StoreError(f"{text}. Nothing of this act was kept", cause=text)

    @contextmanager
    def writing(self, *, synced: bool = True) -> Iterator[sa.Connection]:
        """Give the one writing connection inside a transaction: all of it is kept, or nothing.

        What is not `synced` outlives this process at once, but a power cut only when the next synced transaction ends:
        a log is written in order, so that one carries all before it to the disk. Raises StoreError, naming who holds
        the connection, when it does not come free within 20 s.
        """
        if self.writer is not None:
            raise StoreError(
                f"{self._shown}: another process writes to it; only a marked transaction can be sent there"
            )
        counted = synced and self._sqlite
        with self._turn.take():
            try:
                self._sync(synced)
                with self._engine.begin() as connection:
                    yield connection
                    self._refuse_other_file()
                    commits = count_commit(connection) if counted else 0
            except exc.DatabaseError as error:
                if isinstance(error, exc.IntegrityError | exc.ProgrammingError):
                    raise
                self._refuse_other_file()
                raise self._trouble(error) from error
            if counted:
                seal(self.location, commits)

    def _trouble(self, error: exc.DatabaseError) -> StoreError:
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
        """Give a connection to read with. Raises StoreError."""
        self._refuse_other_file()  # a new connection would make an empty file, or read another one's rows
        try:
            with self._reader.connect() as connection:
                yield connection
        except exc.DatabaseError as error:
            raise StoreError(f"{self._shown}: {error.orig}") from error

    def note_address(self, address: ServiceAddress) -> None:
        """Write down at which address the service that holds this database is reached now."""
        if self._lock is not None:
            with suppress(OSError):  # a full disk: the note is only a hint
                self._lock.note(address)

    def close(self) -> None:
        """Close the database and let the next writer in."""
        self._identity = None  # the log goes with the last connection
        self._reader.dispose()
        self._engine.dispose()
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None
