"""Versions of a unit's accelerometer and magnetometer: numbered per serial number and sensor, never changed."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.acting_user import acting_key
from labctl.answers.json_object import JsonDocument
from labctl.canonical_json import canonical
from labctl.errors import NotFound, StoreError, VersionTaken
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.manifests.contents import SENSOR_VERSION
from labctl.store.repositories.audit import append
from labctl.store.repositories.units import add_missing_unit
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal

Sensor = Literal["accelerometer", "magnetometer"]


@dataclass(frozen=True)
class NewSensorVersion:
    """A result that is about to be kept."""

    serial: str
    sensor: Sensor
    verdict: str
    data: JsonDocument  #: how the files were read, and the name and SHA-256 of each
    result: JsonDocument  #: parameters, covariance, figures and text
    by: str


@dataclass(frozen=True)
class SensorVersionRow(NewSensorVersion):
    """A result as it is kept."""

    version: int
    hash: str  #: SHA-256 of the result in canonical JSON
    by_key: str | None
    at: datetime


class SensorVersions:
    """Every version of every unit's accelerometer and magnetometer."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def add(self, new: NewSensorVersion, at: datetime) -> SensorVersionRow:
        """Keep the next version; a unit that is not there yet is added. Raises VersionTaken; nothing was changed."""
        document = canonical(new.result)
        digest = hashlib.sha256(document).hexdigest()
        t, key = tables.sensor_versions, acting_key()
        try:
            with self._database.writing() as connection:
                add_missing_unit(connection, new.serial, "", None, at)
                last = sa.select(sa.func.max(t.c.version)).where(t.c.serial == new.serial, t.c.sensor == new.sensor)
                version = int(connection.scalar(last) or 0) + 1
                values = {
                    "serial": new.serial, "sensor": new.sensor, "version": version, "verdict": new.verdict,
                    "data": dict(new.data), "document": document, "hash": digest, "by": new.by, "by_key": key, "at": at,
                }  # fmt: skip
                number = connection.scalar(sa.insert(t).values(**values).returning(t.c.id))
                detail: dict[str, Any] = {"verdict": new.verdict, "hash": digest, "data": dict(new.data), "by": new.by}
                subject = f"{new.serial} {new.sensor} version {version}"
                append(connection, at, f"{new.sensor} version", subject, detail, who=key or new.by)
                seal(connection, (SENSOR_VERSION.name, str(number)), at, "kept")
        except exc.IntegrityError as error:  # where several processes write
            raise VersionTaken(
                f"a version of the {new.sensor} of {new.serial} was stored by another request in the meantime; send "
                "this one again"
            ) from error
        return SensorVersionRow(**vars(new), version=version, hash=digest, by_key=key, at=at)

    def of_unit(self, serial: str) -> list[SensorVersionRow]:
        """Return every version of a unit's sensors, by sensor, newest first. Raises StoreError for a changed one."""
        t = tables.sensor_versions
        query = sa.select(t).where(t.c.serial == serial).order_by(t.c.sensor, t.c.version.desc())
        with self._database.reading() as connection:
            return [_row(row) for row in connection.execute(query)]

    def get(self, serial: str, sensor: Sensor, version: int | None = None) -> SensorVersionRow:
        """Return a version, or the newest. Raises NotFound, StoreError for one that was changed."""
        t = tables.sensor_versions
        query = sa.select(t).where(t.c.serial == serial, t.c.sensor == sensor)
        if version is not None:
            query = query.where(t.c.version == version)
        with self._database.reading() as connection:
            row = connection.execute(query.order_by(t.c.version.desc()).limit(1)).first()
        if row is None:
            which = f"the {sensor} of unit {serial!r} has no " + (
                "version" if version is None else f"version {version}"
            )
            raise NotFound(
                f"{which}; `labctl {sensor} FILE --serial {serial}` keeps one, `labctl sensors list` shows them"
            )
        return _row(row)


def _row(row: sa.Row[Any]) -> SensorVersionRow:
    document = row.document.encode() if isinstance(row.document, str) else bytes(row.document)  # another program's
    if hashlib.sha256(document).hexdigest() != row.hash:
        raise StoreError(
            f"{row.serial} {row.sensor} version {row.version}: the stored result does not fit its hash; it was changed "
            "after it was stored; see `labctl check`"
        )
    return SensorVersionRow(
        row.serial, row.sensor, row.verdict, row.data, json.loads(document), row.by,
        version=row.version, hash=row.hash, by_key=row.by_key, at=row.at,
    )  # fmt: skip
