"""One database: SQLite in a file by default; the same statements run on PostgreSQL."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol, TypeVar

import sqlalchemy as sa
from sqlalchemy import exc
from sqlalchemy.exc import DatabaseError

from instruments.clock import Clock, WallClock
from labctl.errors import DatabaseUnreachable, DiskFull, OldSchema, ReadOnly, StoreError
from labctl.store import migrate
from labctl.store.connection.backend import Backend
from labctl.store.connection.location import is_url, shown
from labctl.store.connection.lookup import FileLookup, Lookup, ServerLookup
from labctl.store.connection.postgresql_server import PostgresqlServer
from labctl.store.connection.sqlite_file import SqliteFile
from labctl.store.connection.sqlite_reader import SqliteReader
from labctl.store.connection.writer_lock import NO_SERVICE, ServiceAddress
from labctl.store.connection.writer_turn import WriterTurn
from labctl.store.manifests import chain
from labctl.store.manifests.chain import ChainHead

ResultT = TypeVar("ResultT")

#: A server that does not answer is asked again after so long, s.
RETRY_S = 0.5
#: A transaction that is under way when the database is closed has so long to end, s of wall time.
CLOSED_WITHIN_S = 2.0


class Writer(Protocol):
    """The process that writes, as another one reaches it."""

    def run(self, name: str, args: tuple[object, ...], kwargs: Mapping[str, object]) -> object:
        """Run the transaction of this name there; returns or raises what it did."""
        ...


class Database:
    """A database at today's schema. `write` holds it for this process; without, only `reading` may be used.

    `writer` runs the transactions of a process that does not hold it. `address` is written into the note that tells
    other processes who holds it, and into the leases that it takes. `clock` times how long a server that does not
    answer is asked again.

    `as_it_is` opens a database without making or migrating it: the file may be of any kind. `read_only` opens one that
    this process may never change, nor make: its transactions are refused here and by the database itself.
    """

    def __init__(
        self,
        location: str,
        *,
        write: bool,
        address: ServiceAddress = NO_SERVICE,
        writer: Writer | None = None,
        as_it_is: bool = False,
        read_only: bool = False,
        clock: Clock | None = None,
    ) -> None:
        self.location, self._shown = location, shown(location)
        self.writes, self.is_read_only = write, read_only
        self.writer = writer
        self.address = address
        self._clock = clock or WallClock()
        self._turn = WriterTurn(self._shown)
        self._is_away = False  #: whether the server was waited for in vain, and has not answered since
        self.on_growth: Callable[[ChainHead], None] | None = None  #: called when manifests were added and committed
        self._backend = self._open_backend(address, as_it_is=as_it_is)
        self._engine, self._reader = self._backend.engines()
        try:
            if not as_it_is:
                self._refuse_old()
            self._backend.opened(self._engine)
        except BaseException:
            self._dispose()
            raise

    def _open_backend(self, address: ServiceAddress, *, as_it_is: bool) -> Backend:
        if is_url(self.location):
            return PostgresqlServer(self.location, write=self.writes, read_only=self.is_read_only)
        if self.is_read_only:
            return SqliteReader(self.location)
        if not as_it_is:
            Path(self.location).parent.mkdir(parents=True, exist_ok=True)
        if not self.writes and not Path(self.location).exists():
            if as_it_is:
                raise StoreError(f"{self.location}: there is no such file; name the database with --database")
            Database(self.location, write=True).close()
        return SqliteFile(self.location, address if self.writes else None)

    @property
    def is_shared(self) -> bool:
        """Whether it is on a server, where several processes may write to it."""
        return is_url(self.location)

    @property
    def anchor_fits(self) -> bool:
        """Whether the chain of manifests goes on from what the anchor file names; also where there is no file."""
        return self._backend.anchor_fits

    def _refuse_old(self) -> None:
        """Make the tables of an empty database; one of an earlier version is only migrated when a person asks."""
        revision = self.revision()
        if revision is None and self.is_read_only:
            raise StoreError(
                f"{self._shown}: the database has no tables of labctl, and a service that only reads makes none; name "
                "the database of a labctl service with --database"
            )
        if revision is None:
            if not self.writes and not is_url(self.location):
                Database(self.location, write=True).close()
            else:
                self.upgrade()
        elif revision != migrate.HEAD:
            migrate.refuse_unknown(revision, self._shown)
            raise OldSchema(
                f"{self._shown}: the schema of the database is number {revision}, this version of labctl needs number "
                f"{migrate.HEAD}; run `labctl migrate --database {self._shown}`"
            )

    def revision(self) -> str | None:
        """Return at which schema a database stands, None for an empty one. Raises StoreError for a damaged one."""
        with self._as_database():
            return self.outlast(self._revision)

    def upgrade(self) -> None:
        """Migrate the database to the present tables in one transaction: all of it, or nothing. Raises StoreError.

        A database at the present tables gets the indexes that a server can have and that are missing.
        """
        with self._as_database(), self._engine.begin() as connection:
            self._backend.before_migration(connection)
            migrate.upgrade(connection)
            self._backend.after_migration(connection)

    @contextmanager
    def _as_database(self) -> Iterator[None]:
        try:
            yield
        except DatabaseError as error:
            trouble = self._trouble(error)
            if isinstance(trouble, DiskFull | DatabaseUnreachable) or self._backend.words_for(error):
                raise trouble from error
            raise StoreError(
                f"{self._shown}: not a labctl database, or damaged ({error.orig}); "
                "restore a backup, or name another file with --database"
            ) from error

    def _revision(self) -> str | None:
        try:
            with self._engine.connect() as connection:
                self._backend.before_opening(connection)
                return migrate.revision_of(connection)
        except DatabaseError as error:
            if self._backend.is_unreachable(error):
                raise self._trouble(error) from error
            raise

    def outlast(self, work: Callable[[], ResultT]) -> ResultT:
        """Do something again for as long as the server does not answer, at most `patience_s`.

        Returns what `work` does. Raises DatabaseUnreachable after that time; then, too, nothing was stored. From then
        on, until it has answered again, the server is asked once: what a campaign writes down as it ends must not keep
        its table turning for as long again each time.
        """
        end_s = self._clock.now_s() + (0.0 if self._is_away else self._backend.patience_s)
        while True:
            try:
                done = work()
            except DatabaseUnreachable:
                if self._clock.now_s() >= end_s:
                    self._is_away = True
                    raise
                self._clock.sleep(RETRY_S)
            else:
                self._is_away = False
                return done

    @contextmanager
    def writing(self, *, synced: bool = True) -> Iterator[sa.Connection]:
        """Yield the one writing connection inside a transaction, which is committed as a whole or rolled back.

        What is not `synced` outlives this process at once, but a power cut only when the next synced transaction ends:
        a log is written in order, so that one carries all before it to the disk. Raises StoreError, naming who holds
        the connection, when it does not come free within 20 s, and DatabaseUnreachable.
        """
        if self.is_read_only:
            raise ReadOnly(
                f"{self._shown}: this process only reads the database, nothing was stored; send the request to a "
                "service that writes to it"
            )
        if self.writer is not None:
            raise StoreError(f"{self._shown}: another process is writing to the database; wait until that process ends")
        number, ended, grown = 0, False, None
        with self._turn.take():
            try:
                self._backend.before_begin(self._engine, synced=synced)
                with self._engine.begin() as connection:
                    number = self._backend.begun(connection, synced=synced)
                    chain.begin(connection)
                    yield connection
                    grown = chain.finish(connection)
                    commits = self._backend.before_commit(connection, synced=synced)
                    ended = True
            except exc.DatabaseError as error:
                is_of_labctl = isinstance(error, exc.IntegrityError | exc.ProgrammingError)
                if is_of_labctl and not self._backend.words_for(error):
                    raise
                self._backend.refuse_other()
                if not (ended and self._backend.is_unreachable(error) and self.outlast(lambda: self._is_kept(number))):
                    raise self._trouble(error) from error
                commits = 0
            self._backend.committed(commits)
            if grown is not None:
                self._backend.grown(grown)
                if self.on_growth is not None:
                    self.on_growth(grown)

    def _is_kept(self, number: int) -> bool:
        """Return whether a transaction was committed whose commit was not answered. Raises DatabaseUnreachable."""
        try:
            return self._backend.was_committed(number)
        except DatabaseError as error:
            raise self._trouble(error) from error

    def _trouble(self, error: exc.DatabaseError) -> StoreError:
        if self._backend.is_disk_full(error):
            cause = f"{self._shown}: the disk is full"
            return DiskFull(f"{cause}; nothing was stored. Free disk space, then continue", cause=cause)
        text = " ".join(str(error.orig).split())
        if self._backend.is_unreachable(error):
            cause = f"{self._shown}: the database server does not answer ({text})"
            return DatabaseUnreachable(f"{cause}; nothing was stored. Try again once it runs", cause=cause)
        cause = f"{self._shown}: {self._backend.words_for(error) or text}"
        return StoreError(f"{cause}; nothing was stored, try again", cause=cause)

    @contextmanager
    def reading(self) -> Iterator[sa.Connection]:
        """Yield a connection to read with. Raises StoreError."""
        self._backend.refuse_other()  # a new connection would make an empty file, or read another one's rows
        try:
            with self._backend.unchanged(), self.outlast(self._connect_reader) as connection:
                yield connection
        except exc.DatabaseError as error:
            raise self._unread(error) from error

    def lookup(self, statement: sa.Select[*tuple[Any, ...]]) -> Lookup:
        """Return the reads of one statement by keys (`lookup.KEYS`), for requests in an event loop.

        It has to be a statement that finds its rows by indexes, whatever the keys are.
        """
        connection = self._backend.lookup_connection()
        if connection is None:
            return FileLookup(self.reading, statement)
        return ServerLookup(connection, statement, self._unread_by_driver, self._backend.patience_s)

    def _unread_by_driver(self, error: Exception) -> StoreError:
        """Return what is raised in place of an error of psycopg."""
        kind = exc.OperationalError if type(error).__name__ == "OperationalError" else exc.DatabaseError
        return self._unread(kind("", None, error))

    def _connect_reader(self) -> sa.Connection:
        try:
            return self._reader.connect()
        except exc.DatabaseError as error:
            raise self._unread(error) from error
        except exc.TimeoutError as error:
            raise StoreError(f"{self._shown}: all connections are in use; try again in a few seconds") from error

    def _unread(self, error: exc.DatabaseError) -> StoreError:
        text = f"{self._shown}: {self._backend.words_for(error) or error.orig}"
        return (DatabaseUnreachable if self._backend.is_unreachable(error) else StoreError)(text)

    def note_address(self, address: ServiceAddress) -> None:
        """Write down at which address the service that holds this database is reached now."""
        self.address = address
        self._backend.note_address(address)

    def close(self) -> None:
        """Close the database and let the next writer in, once the transaction under way has ended; refuse later ones.

        Where it does not end within `CLOSED_WITHIN_S`, its connection stays open, and the lock held, until the process
        ends: nothing is taken from under it, and no other process writes beside it.
        """
        if self._turn.end(CLOSED_WITHIN_S):
            self._dispose()
        else:
            self._reader.dispose()

    def _dispose(self) -> None:
        self._reader.dispose()
        self._engine.dispose()
        self._backend.close()
