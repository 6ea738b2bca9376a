"""Units that are due: those whose version in force is valid until a date that is near, or has passed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

import sqlalchemy as sa

from labctl.store.connection.database import Database
from labctl.store.paging import Page, PageRequest, parts_of, rows_to_read
from labctl.store.records import Unit
from labctl.store.repositories.records_by_name import records_of
from labctl.store.repositories.units import SEEN, search_units, unit_rows
from labctl.store.schema import tables


def _newest_act(of_units: sa.ColumnElement[bool] | None = None) -> sa.Select[tuple[int]]:
    """Return the numbers of the newest act on each unit, of all of them or of some."""
    x = tables.certifications.c
    newest = sa.select(sa.func.max(x.id)).group_by(x.serial)
    return newest if of_units is None else newest.where(of_units)


class DueUnits:
    """The units whose version in force has a date. A unit without a date, or without such a version, is never due."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def page(self, request: PageRequest[str], until: datetime) -> Page[Unit, str]:
        """Return the units that are due until an instant: the earliest date first, then in natural order.

        Where the unit that a page begins after is no longer due, it begins with the first one.
        """
        x, u = tables.certifications.c, tables.units.c
        is_due = sa.and_(x.id.in_(_newest_act()), x.act == "certify", x.due_at <= until)
        joined = tables.units.join(tables.certifications, x.serial == u.serial)
        due_units = sa.select(u.serial).select_from(joined).where(is_due, search_units(request), SEEN)
        with self._database.reading() as connection:
            serials = list(connection.scalars(due_units.order_by(x.due_at, u.serial_key)))
            first = serials.index(request.after) + 1 if request.after in serials else 0
            last = None if request.limit is None else first + (rows_to_read(request) or 0)
            page = Page.of(serials[first:last], str, request, len(serials))
            units: dict[str, Unit] = {}
            for some in parts_of(page.rows):
                rows = connection.execute(unit_rows().where(u.serial.in_(some)))
                units |= {unit.serial: unit for unit in records_of(Unit, rows)}
        return Page([units[serial] for serial in page.rows], page.total, page.next_after)

    def count(self, *instants: datetime) -> list[int]:
        """Return how many units are due until each of some instants."""
        x = tables.certifications.c
        due = (sa.func.count(sa.case((x.due_at <= instant, 1))) for instant in instants)
        query = sa.select(*due).where(x.id.in_(_newest_act()), x.act == "certify")
        with self._database.reading() as connection:
            return [int(number) for number in connection.execute(query).one()]

    def campaigns(self, serials: Sequence[str]) -> dict[str, int]:
        """Return serial number -> the campaign that the version in force was measured in, where there is one.

        It is that of the newest recording that the version was fitted to.
        """
        x, c, r = tables.certifications.c, tables.calibrations.c, tables.recordings.c
        some_of = x.serial.in_(sa.bindparam("serials", expanding=True))
        of = sa.and_(c.serial == x.serial, c.version == x.version)
        joined = tables.certifications.join(tables.calibrations, of).join(tables.recordings, r.id == c.recording_id)
        in_force = sa.and_(x.id.in_(_newest_act(some_of)), x.act == "certify", r.campaign_id.is_not(None))
        query = sa.select(x.serial, r.campaign_id).select_from(joined).where(in_force)
        with self._database.reading() as connection:
            rows = [row for some in parts_of(serials) for row in connection.execute(query, {"serials": some})]
        return {row.serial: int(row.campaign_id) for row in rows}
