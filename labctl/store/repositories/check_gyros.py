"""Check gyros: units that are measured in each campaign to check the bench; rows are only ever added."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import date, datetime
from typing import Any, Literal

import sqlalchemy as sa

from labctl.acting_user import acting_key
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import CHECK_GYRO
from labctl.store.repositories.audit import append
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal


@dataclass(frozen=True)
class CheckGyroRow:
    """An act on a check gyro: a unit that is measured in each campaign to check the bench."""

    serial: str
    act: Literal["mark", "unmark"]
    temperature_c: float | None  #: of the bias that its chart shows
    chart_from: date | None  #: first day of its chart; None: all of its recordings
    reason: str
    by: str
    at: datetime


class CheckGyros:
    """The units that serve as check standards."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[CheckGyroRow]:
        """Return the newest act of each unit that is marked, by serial number in natural order."""
        t, u = tables.check_gyros, tables.units.c
        last = sa.select(sa.func.max(t.c.id)).group_by(t.c.serial)
        marked = sa.select(t).where(t.c.id.in_(last), t.c.act == "mark")
        query = marked.join(tables.units, u.serial == t.c.serial).order_by(u.serial_key)
        with self._database.reading() as connection:
            return [_row(row) for row in connection.execute(query)]

    @transaction
    def add(self, row: CheckGyroRow) -> None:
        """Enter an act on a unit that is there."""
        values = {**asdict(row), "chart_from": None if row.chart_from is None else row.chart_from.isoformat()}
        detail = {name: values[name] for name in ("temperature_c", "chart_from", "reason")}
        with self._database.writing() as connection:
            t = tables.check_gyros
            number = connection.scalar(sa.insert(t).values(**values).returning(t.c.id))
            append(connection, row.at, f"check gyro {row.act}", row.serial, detail, who=acting_key() or row.by)
            seal(connection, (CHECK_GYRO.name, str(number)), row.at, row.act)


def _row(row: sa.Row[Any]) -> CheckGyroRow:
    first = None if row.chart_from is None else date.fromisoformat(row.chart_from)
    return CheckGyroRow(row.serial, row.act, row.temperature_c, first, row.reason, row.by, row.at)
