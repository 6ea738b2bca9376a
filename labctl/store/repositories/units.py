"""Units: gyros by serial number."""

from __future__ import annotations

from datetime import datetime

import sqlalchemy as sa

from labctl.errors import NotFound
from labctl.store.connection.database import Database
from labctl.store.records import Unit
from labctl.store.schema import tables


def _whole_recordings() -> sa.ColumnElement[bool]:
    r = tables.recordings.c
    return sa.exists().where(r.serial == tables.units.c.serial, r.importing.is_(None))


#: A unit that only an import under way has brought in is not there yet.
SEEN = _whole_recordings()


def add_missing_unit(connection: sa.Connection, serial: str, model: str, technology: str | None, at: datetime) -> bool:
    """Keep a unit that is seen for the first time; returns whether it was."""
    known = connection.scalar(sa.select(tables.units.c.serial).where(tables.units.c.serial == serial))
    if known is None:
        connection.execute(
            sa.insert(tables.units).values(serial=serial, model=model, technology=technology, first_seen_at=at)
        )
    return known is None


def remember_unit(connection: sa.Connection, serial: str, model: str, technology: str | None, at: datetime) -> None:
    """Keep a unit that is seen for the first time; fill in what was not known of it."""
    if add_missing_unit(connection, serial, model, technology, at):
        return
    found = connection.execute(sa.select(tables.units).where(tables.units.c.serial == serial)).one()
    if (model and not found.model) or (technology and not found.technology):
        connection.execute(
            sa.update(tables.units)
            .where(tables.units.c.serial == serial)
            .values(model=found.model or model, technology=found.technology or technology)
        )


class Units:
    """Gyros by serial number."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def get(self, serial: str) -> Unit:
        """Return a unit; raises NotFound naming the nearest things to do."""
        with self._database.reading() as connection:
            row = connection.execute(sa.select(tables.units).where(tables.units.c.serial == serial, SEEN)).first()
        if row is None:
            raise NotFound(f"unit {serial!r} is not in this database; `labctl import DIR` or a campaign adds it")
        return Unit(*row)

    def count(self) -> int:
        """Return how many units there are."""
        with self._database.reading() as connection:
            return int(connection.scalar(sa.select(sa.func.count()).select_from(tables.units).where(SEEN)) or 0)

    def all(self) -> list[Unit]:
        """Return every unit, by serial number."""
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(tables.units).where(SEEN).order_by(tables.units.c.serial))
            return [Unit(*row) for row in rows]
