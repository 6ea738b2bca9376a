"""The newest calibrations and certifications of all units, for who looks what has happened: few columns, two reads."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import sqlalchemy as sa

from labctl.store.connection.database import Database
from labctl.store.schema import tables

CalibrationAct = Literal["made", "certify", "revoke"]


@dataclass(frozen=True)
class CalibrationEvent:
    """A version that was made, or an act upon one."""

    serial: str
    version: int
    act: CalibrationAct
    at: datetime
    by: str  #: who certified or revoked it; empty for one that was made
    model: str


class CalibrationEvents:
    """What has happened to calibrations, of all units."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def newest(self, most: int) -> list[CalibrationEvent]:
        """Return at most so many events, newest first."""
        c, x = tables.calibrations.c, tables.certifications.c
        of_version = sa.and_(c.serial == x.serial, c.version == x.version)
        made = sa.select(c.serial, c.version, c.created_at, c.model).order_by(c.id.desc()).limit(most)
        acts = (
            sa.select(x.serial, x.version, x.act, x.at, x.by, c.model)
            .select_from(tables.certifications.join(tables.calibrations, of_version))
            .order_by(x.id.desc())
            .limit(most)
        )
        with self._database.reading() as connection:
            events = [
                CalibrationEvent(row.serial, row.version, row.act, row.at, row.by, row.model)
                for row in connection.execute(acts)
            ]
            events += [
                CalibrationEvent(row.serial, row.version, "made", row.created_at, "", row.model)
                for row in connection.execute(made)
            ]
        return sorted(events, key=lambda event: event.at, reverse=True)[:most]
