"""A PostgreSQL server: transactions one after the other, and a server that is restarted below a campaign.

Writing transactions of all processes run one at a time, as on SQLite, held by an advisory lock that ends with the
transaction: what a transaction reads cannot change before it commits. The server ends what waits for the lock, or does
nothing while it has it, so that a process that hangs or a network that is cut stops no bench for good.

PostgreSQL 15 documentation: 9.27.10 (advisory locks), 9.27.8 (pg_xact_status), 20.11 (client connection defaults).
"""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.log import get_logger
from labctl.store.connection.backend import Backend
from labctl.store.connection.engines import lookup_connection, server_engine

log = get_logger()

#: "labctl" in ASCII: the lock that a writing transaction has.
WRITER_KEY = int.from_bytes(b"labctl", "big")
#: How long a transaction waits for the one before it; the server ends a transaction that is idle for as long, s.
LOCK_TIMEOUT_S = IDLE_TIMEOUT_S = 20
#: For how long a server that does not answer is asked again, s: a campaign survives a restart of the server within
#: 30 s, and a request that only reads soon gets the answer that the server cannot be reached.
WRITER_PATIENCE_S, READER_PATIENCE_S = 45.0, 2.0
#: SQLSTATEs of a full disk, and of a lock that was not granted in time.
DISK_FULL, LOCK_NOT_AVAILABLE = "53100", "55P03"
#: SQLSTATEs of a user without a right, and of a server that follows another one.
INSUFFICIENT_PRIVILEGE, READ_ONLY_TRANSACTION = "42501", "25006"
#: The class of errors that are about the connection and not about the statement, and the errors of a server that is
#: shut down, was killed, is starting, drops its database, or has no connection left. The codes are SQLSTATEs.
CONNECTION_CLASS = "08"
SERVER_AWAY = frozenset({"57P01", "57P02", "57P03", "57P05", "25P03", "53300"})
#: Messages of a server that refuses a connection; waiting does not help. The client library gives no SQLSTATE.
REFUSALS = ("authentication failed", "does not exist", "no pg_hba.conf entry", "permission denied", "not permitted")

#: The extension by which any part of a text is found by an index, and the index; its name begins as no other's does.
SEARCH_EXTENSION, SEARCH_INDEX = "pg_trgm", "search_units"
_SEARCH_INDEX = (
    f"CREATE INDEX IF NOT EXISTS {SEARCH_INDEX} ON units USING gin "
    f"({', '.join(f'{name} gin_trgm_ops' for name in ('serial', 'model', 'technology', 'batch', 'supplier'))})"
)

_BEGIN = sa.text("SELECT pg_current_xact_id()::text FROM (SELECT pg_advisory_xact_lock(:key)) AS turn")
_STATUS = sa.text("SELECT pg_xact_status(CAST(:number AS xid8))")


class PostgresqlServer(Backend):
    """The backend of a database by URL. No process holds it; with `write` an absent server is waited for longer."""

    def __init__(self, url: str, *, write: bool, read_only: bool = False) -> None:
        """With `read_only` the server refuses every change. Raises BadInput for a URL that is not known here."""
        self.patience_s = WRITER_PATIENCE_S if write else READER_PATIENCE_S
        self._url, self._read_only = url, read_only
        self._engine = server_engine(
            url, lock_timeout_s=LOCK_TIMEOUT_S, idle_timeout_s=IDLE_TIMEOUT_S, read_only=read_only
        )

    def engines(self) -> tuple[sa.Engine, sa.Engine]:
        """Return two engines that share connections; a reader sees one state of the database and changes nothing."""
        reader = self._engine.execution_options(isolation_level="REPEATABLE READ", postgresql_readonly=True)
        return self._engine, reader

    def lookup_connection(self) -> dict[str, Any]:
        """Return psycopg's arguments for a connection whose statements are planned once."""
        return lookup_connection(self._url, lock_timeout_s=LOCK_TIMEOUT_S, read_only=self._read_only)

    def before_migration(self, connection: sa.Connection) -> None:
        """Wait for another process that migrates."""
        self.begun(connection, synced=True)

    def begun(self, connection: sa.Connection, *, synced: bool) -> int:
        """Wait for the turn to write; returns the number of the transaction."""
        if not synced:
            connection.exec_driver_sql("SET LOCAL synchronous_commit = off")
        return int(connection.scalar(_BEGIN, {"key": WRITER_KEY}))

    def is_unreachable(self, error: exc.DatabaseError) -> bool:
        """Return whether the connection is lost, or the server shuts down, starts, or is not there."""
        state = getattr(error.orig, "sqlstate", None)
        if state is None:  # said by the client library: no answer, lost, timed out
            return isinstance(error, exc.OperationalError) and not _is_refusal(error)
        return state in SERVER_AWAY or state.startswith(CONNECTION_CLASS)

    def is_disk_full(self, error: exc.DatabaseError) -> bool:
        """Return whether the server says `disk_full`."""
        return getattr(error.orig, "sqlstate", None) == DISK_FULL

    def words_for(self, error: exc.DatabaseError) -> str:
        """Return the message for what the server refuses, or for a lock that was not granted in time; else empty."""
        state, text = getattr(error.orig, "sqlstate", None), " ".join(str(error.orig).split())
        if state is None and _is_refusal(error):
            return f"the database server refuses the connection ({text}); check user, password and database in the URL"
        if state == INSUFFICIENT_PRIVILEGE:
            return (
                f"the user '{self._engine.url.username}' of the database lacks a right ({text}); the owner of the "
                "tables gives it: SELECT on all tables to read; to write also INSERT, UPDATE and DELETE on them, and "
                "USAGE on all sequences"
            )
        if state == READ_ONLY_TRANSACTION:
            return f"the database server takes no changes ({text}); use the URL of the primary server"
        if state != LOCK_NOT_AVAILABLE:
            return ""
        return (
            f"no write access within {LOCK_TIMEOUT_S:g} s: another process holds the lock; find out which "
            "process writes to the database"
        )

    def after_migration(self, connection: sa.Connection) -> None:
        """Index every part of the texts that units are searched by, where the server has the extension for it.

        PostgreSQL 15 documentation, F.35.4 (pg_trgm). Without it nothing fails: a search reads every unit.
        """
        try:
            with connection.begin_nested():
                connection.exec_driver_sql(f"CREATE EXTENSION IF NOT EXISTS {SEARCH_EXTENSION}")
                connection.exec_driver_sql(_SEARCH_INDEX)
        except exc.DatabaseError as error:
            if self.is_unreachable(error) or self.is_disk_full(error):
                raise
            log.warning(
                "search.not_indexed", reason=" ".join(str(error.orig).split()),
                text=f"a search for units reads every unit (2 s for 1,000,000); install {SEARCH_EXTENSION} on the "
                "server, then run `labctl migrate --without-copy`",
            )  # fmt: skip

    def was_committed(self, number: int) -> bool:
        """Ask the server whether a transaction was committed, once it is over and no longer has the writer's lock."""
        with self._engine.connect() as connection:
            self.begun(connection, synced=True)
            return connection.scalar(_STATUS, {"number": str(number)}) == "committed"


def _is_refusal(error: exc.DatabaseError) -> bool:
    return any(words in str(error.orig) for words in REFUSALS)
