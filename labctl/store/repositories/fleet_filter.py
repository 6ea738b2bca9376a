"""Which units a fleet job, a report or a chart is about, as a condition of the database."""

from __future__ import annotations

from dataclasses import dataclass

import sqlalchemy as sa

from labctl.errors import NotFound
from labctl.store.paging import PageRequest
from labctl.store.repositories.units import SEEN, search_units
from labctl.store.schema import tables


@dataclass(frozen=True)
class FleetFilter:
    """Which units: of a type (their model), a batch, a supplier, with a text, and by the error model of their newest
    version; empty: any."""

    type: str = ""
    batch: str = ""
    supplier: str = ""
    search: str = ""
    error_model: str = ""

    @property
    def condition(self) -> sa.ColumnElement[bool]:
        """The condition on rows of the table of units."""
        return sa.and_(SEEN, self.of_measured)

    @property
    def of_measured(self) -> sa.ColumnElement[bool]:
        """The same for units that are known to be measured, as those with a version or a result are."""
        c = tables.units.c
        stated = [
            column == value
            for column, value in ((c.model, self.type), (c.batch, self.batch), (c.supplier, self.supplier))
            if value
        ]
        if self.error_model:
            stated.append(_newest_has_model(self.error_model))
        return sa.and_(search_units(PageRequest(self.search)), *stated)

    def no_match(self) -> NotFound:
        """Return the error where no unit is so."""
        given = {
            "type": self.type, "batch": self.batch, "supplier": self.supplier, "text": self.search,
            "error model": self.error_model,
        }  # fmt: skip
        named = [f"{name} {value!r}" for name, value in given.items() if value]
        if named:
            return NotFound(f"no unit matches {', '.join(named)}; `labctl units` lists the units")
        return NotFound("the database has no unit with a recording; `labctl import` adds recordings")


def _newest_has_model(model: str) -> sa.ColumnElement[bool]:
    """Return the condition that the newest version of a row of the table of units is of an error model."""
    own, later = tables.calibrations.alias(), tables.calibrations.alias()
    newest = sa.select(sa.func.max(later.c.version)).where(later.c.serial == tables.units.c.serial)
    return sa.exists().where(
        own.c.serial == tables.units.c.serial,
        own.c.version == newest.correlate(tables.units).scalar_subquery(),
        own.c.model == model,
    )
