"""Who fetched which version: a row for each API key and version, with the first and the last time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables


@dataclass(frozen=True)
class FetchRow:
    """Fetches of one version by one key; `who` is the key's name, or `anonymous` for all who sent none."""

    serial: str
    version: int
    who: str
    first_at: datetime
    last_at: datetime


class Fetches:
    """Fetches of calibrations over HTTP."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def record(self, rows: Sequence[FetchRow]) -> None:
        """Keep fetches: where a version was fetched by a key before, the earlier first and the later last time stay."""
        with self._database.writing() as connection:
            for row in rows:
                _record(connection, row)

    def of_version(self, serial: str, version: int) -> list[FetchRow]:
        """Return who fetched a version, the newest fetch first."""
        f = tables.calibration_fetches.c
        query = sa.select(f.serial, f.version, f.who, f.first_at, f.last_at).where(
            f.serial == serial, f.version == version
        )
        with self._database.reading() as connection:
            return records_of(FetchRow, connection.execute(query.order_by(f.last_at.desc(), f.who)))


def _record(connection: sa.Connection, row: FetchRow) -> None:
    table = tables.calibration_fetches
    f = table.c
    same = sa.and_(f.serial == row.serial, f.version == row.version, f.who == row.who)
    fetched = connection.execute(sa.select(f.first_at, f.last_at).where(same).with_for_update()).first()
    if fetched is None:
        values = {"serial": row.serial, "version": row.version, "who": row.who}
        connection.execute(sa.insert(table).values(**values, first_at=row.first_at, last_at=row.last_at))
        return
    first, last = min(fetched.first_at, row.first_at), max(fetched.last_at, row.last_at)
    connection.execute(sa.update(table).where(same).values(first_at=first, last_at=last))
