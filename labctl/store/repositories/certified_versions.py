"""The certified versions of a unit, or of the units of a model, with the days of their measurements: few statements."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from labctl.answers.json_object import JsonObject
from labctl.recording.info import measured_at
from labctl.store.connection.database import Database
from labctl.store.schema import tables

#: Units of a model that are searched, those first that were certified last.
MAX_UNITS = 400


@dataclass(frozen=True)
class CertifiedVersion:
    """A version that was certified, perhaps revoked since, without its document."""

    id: int
    serial: str
    version: int
    measured_at: datetime | None  #: when its newest recording was begun; None where one has no date
    recordings: frozenset[int]
    campaigns: frozenset[int]  #: of its recordings; those that were imported have none


def _heads() -> sa.Select[*tuple[Any, ...]]:
    c, f, r = tables.calibrations.c, tables.calibration_recordings.c, tables.recordings.c
    begun = r.info.label("head")
    joined = tables.calibrations.outerjoin(tables.calibration_recordings, f.calibration_id == c.id)
    columns = (c.id, c.serial, c.version, c.created_at, r.id.label("recording"), r.campaign_id, begun)
    return sa.select(*columns).select_from(joined.outerjoin(tables.recordings, r.id == f.recording_id))


def _certified() -> sa.Exists:
    c, x = tables.calibrations.c, tables.certifications.c
    return sa.exists().where(x.serial == c.serial, x.version == c.version, x.act == "certify")


class CertifiedVersions:
    """Certified versions over time."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def of_unit(self, serial: str, version: int) -> list[CertifiedVersion]:
        """Return the certified versions of a unit, and one more whether certified or not, by their numbers."""
        c = tables.calibrations.c
        ours = sa.and_(c.serial == serial, sa.or_(c.version == version, _certified()))
        with self._database.reading() as connection:
            return _versions(connection.execute(_heads().where(ours).order_by(c.version)))

    def of_model(self, model: str, other_than: str) -> list[CertifiedVersion]:
        """Return those of the other units of a model with two or more, the units that were certified last first."""
        u, x, c = tables.units.c, tables.certifications.c, tables.calibrations.c
        newest = sa.func.max(x.id)
        several = (
            sa.select(x.serial, newest.label("act"))
            .join(tables.units, u.serial == x.serial)
            .where(u.model == model, u.serial != other_than, x.act == "certify")
            .group_by(x.serial)
            .having(sa.func.count(sa.distinct(x.version)) > 1)
            .order_by(newest.desc())
            .limit(MAX_UNITS)
            .subquery()
        )
        query = _heads().join(several, several.c.serial == c.serial).where(_certified())
        with self._database.reading() as connection:
            return _versions(connection.execute(query.order_by(several.c.act.desc(), c.version)))

    def documents(self, ids: Collection[int]) -> dict[int, bytes]:
        """Return number of a calibration -> its document."""
        c = tables.calibrations.c
        with self._database.reading() as connection:
            rows = connection.execute(sa.select(c.id, c.document).where(c.id.in_(ids)))
            return {number: bytes(document) for number, document in rows}

    def benches(self, campaigns: Collection[int]) -> Mapping[int, JsonObject]:
        """Return campaign -> the bench that it ran on, as its file said it."""
        c = tables.campaigns.c
        with self._database.reading() as connection:
            return {
                row.id: row.bench for row in connection.execute(sa.select(c.id, c.bench).where(c.id.in_(campaigns)))
            }


def _versions(rows: sa.CursorResult[*tuple[Any, ...]]) -> list[CertifiedVersion]:
    grouped: dict[int, list[Any]] = {}
    for row in rows:
        grouped.setdefault(row.id, []).append(row)
    return [_version(each) for each in grouped.values()]


def _version(rows: list[Any]) -> CertifiedVersion:
    first = rows[0]
    begun = [measured_at(row.head) for row in rows if row.head is not None]
    begin_times = [each for each in begun if each is not None]
    newest = max(begin_times, default=first.created_at) if len(begin_times) == len(begun) else None
    return CertifiedVersion(
        first.id, first.serial, first.version, newest,
        frozenset(row.recording for row in rows if row.recording is not None),
        frozenset(row.campaign_id for row in rows if row.campaign_id is not None),
    )  # fmt: skip
