"""Engines of SQLAlchemy: SQLite with its pragmas and its transactions, or PostgreSQL."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Mapping
from typing import Any
from urllib.parse import quote

import sqlalchemy as sa
from sqlalchemy import event as sa_event
from sqlalchemy import exc
from sqlalchemy.pool import QueuePool, StaticPool

from labctl.errors import BadInput
from labctl.store.connection.location import shown

BUSY_MS = 5000
#: Options of libpq: how long a connection may take to open, and after how long without an answer it counts as lost.
CONNECTION = {
    "connect_timeout": 5,
    "keepalives_idle": 5,
    "keepalives_interval": 5,
    "keepalives_count": 3,
    "tcp_user_timeout": 20_000,
    "application_name": "labctl",
}


def sqlite_engine(location: str, *, write: bool) -> sa.Engine:
    """Return an engine for a database by path; without `write` it refuses to change anything, and makes no file."""
    options: dict[str, Any] = {"poolclass": StaticPool} if write else {}
    # a reader that connects just when the file was deleted would else put an empty one in its place
    to_read = {"mode": "rw", "uri": "true"}
    url = sa.URL.create("sqlite", database=location if write else f"file:{quote(location)}")
    engine = sa.create_engine(
        url if write else url.set(query=to_read),
        connect_args={"check_same_thread": False, "timeout": BUSY_MS / 1000},
        **options,
    )

    @sa_event.listens_for(engine, "connect")
    def prepare(connection: Any, _: Any) -> None:
        connection.isolation_level = None  # transactions are begun below, never by the driver's guess
        for pragma in (
            f"busy_timeout={BUSY_MS}",
            "foreign_keys=ON",
            *(("journal_mode=WAL", "synchronous=FULL") if write else ("query_only=ON",)),
        ):
            connection.execute(f"PRAGMA {pragma}")

    @sa_event.listens_for(engine, "begin")
    def begin(connection: sa.Connection) -> None:
        connection.exec_driver_sql("BEGIN IMMEDIATE" if write else "BEGIN")

    return engine


def sqlite_reading_engine(uri: Callable[[], str]) -> sa.Engine:
    """Return an engine for an SQLite file that is only read; `uri` names the file each time that it is opened."""

    def connect() -> sqlite3.Connection:
        connection = sqlite3.connect(uri(), uri=True, check_same_thread=False, timeout=BUSY_MS / 1000)
        connection.isolation_level = None  # as above
        connection.execute("PRAGMA query_only=ON")
        return connection

    engine = sa.create_engine("sqlite://", creator=connect, poolclass=QueuePool, max_overflow=15)

    @sa_event.listens_for(engine, "begin")
    def begin(connection: sa.Connection) -> None:
        connection.exec_driver_sql("BEGIN")

    return engine


def server_engine(url: str, *, lock_timeout_s: float, idle_timeout_s: float, read_only: bool = False) -> sa.Engine:
    """Return an engine for a database by URL. Raises BadInput for a URL that cannot be used.

    With `read_only` the server itself refuses every change (PostgreSQL 15 documentation, 20.11.1).

    The server ends a statement that waits longer than `lock_timeout_s` for a lock, and a connection that is idle in a
    transaction for longer than `idle_timeout_s`. A connection is tried before it is used, and one whose other end is
    gone is noticed within 20 s.
    """
    advice = "name the path of an SQLite file, or postgresql+psycopg://user:password@host/name"
    limits = {"lock_timeout": lock_timeout_s, "idle_in_transaction_session_timeout": idle_timeout_s}
    settings = {name: str(round(1000 * limit_s)) for name, limit_s in limits.items()}
    arguments = {**CONNECTION, "options": _options(settings, read_only=read_only)}
    try:
        if sa.make_url(url).get_backend_name() == "postgresql":
            return sa.create_engine(url, pool_pre_ping=True, max_overflow=15, connect_args=arguments)
    except (exc.ArgumentError, ValueError):  # ValueError: a port that is no number
        pass
    except ModuleNotFoundError as error:
        raise BadInput(
            f"--database {shown(url)} needs {error.name}, which is not installed; run "
            f"`pip install 'labctl[postgresql]'`; {advice}"
        ) from error
    raise BadInput(f"--database {shown(url)}: this kind of database is not known; {advice}")


def lookup_connection(url: str, *, lock_timeout_s: float, read_only: bool = False) -> dict[str, Any]:
    """Return psycopg's arguments for a connection whose statements find a few rows by indexes.

    Their plan is made once, for whatever parameters. Parts of the URL that are no argument are refused by the server's
    client library, as they are by the engine.
    """
    address = sa.make_url(url)
    settings = {"plan_cache_mode": "force_generic_plan", "lock_timeout": str(round(1000 * lock_timeout_s))}
    named = {"host": address.host, "port": address.port, "user": address.username, "password": address.password}
    parameters = {name: value for name, value in {**named, "dbname": address.database}.items() if value is not None}
    return {**parameters, **address.query, **CONNECTION, "options": _options(settings, read_only=read_only)}


def _options(settings: Mapping[str, str], *, read_only: bool) -> str:
    """Return settings of the server as libpq takes them."""
    whole = {**settings, "jit": "off"}  # compiling a statement over many units takes 0.35 s, more than it saves
    if read_only:
        whole["default_transaction_read_only"] = "on"
    return " ".join(f"-c {name}={value}" for name, value in whole.items())
