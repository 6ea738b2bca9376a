"""Engines of SQLAlchemy: SQLite with its pragmas and its transactions, or PostgreSQL."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from sqlalchemy import event as sa_event
from sqlalchemy import exc
from sqlalchemy.pool import StaticPool

from labctl.errors import BadInput
from labctl.store.connection.location import is_url, shown

BUSY_MS = 5000


def make_engine(location: str, *, write: bool) -> sa.Engine:
    """Return an engine for a database by path or URL. Raises BadInput for a URL that is not known here."""
    if is_url(location):
        return _engine_of_url(location)
    return _sqlite_engine(location, write=write)


def _sqlite_engine(location: str, *, write: bool) -> sa.Engine:
    options: dict[str, Any] = {"poolclass": StaticPool} if write else {}
    engine = sa.create_engine(
        f"sqlite:///{location}",
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


def _engine_of_url(url: str) -> sa.Engine:
    known = "name the path of an SQLite file, or postgresql+psycopg://user:password@host/name"
    try:
        if sa.make_url(url).get_backend_name() == "postgresql":
            return sa.create_engine(url)
    except (exc.ArgumentError, ValueError):  # ValueError: a port that is no number
        pass
    except ModuleNotFoundError as error:
        raise BadInput(
            f"--database {shown(url)}: {error.name} is not installed here: `pip install 'labctl[postgresql]'`; {known}"
        ) from error
    raise BadInput(f"--database {shown(url)}: no database that labctl knows; {known}")
