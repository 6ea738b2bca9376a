"""Reads manifests: those that a certificate names of the records that it rests on."""

from __future__ import annotations

from dataclasses import dataclass

import sqlalchemy as sa

from labctl.store.connection.database import Database
from labctl.store.manifests.contents import CERTIFICATION, RECORDING
from labctl.store.schema import tables


@dataclass(frozen=True)
class ManifestRow:
    """The newest manifest of a record."""

    sequence: int
    hash: str


class Manifests:
    """The chain of manifests."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def of_recording(self, recording: int) -> ManifestRow | None:
        """Return the newest manifest of a recording; None for one that is not sealed."""
        return self._newest(RECORDING.name, str(recording))

    def of_certification(self, serial: str, version: int) -> ManifestRow | None:
        """Return the manifest of the newest act on a version; None where there is none."""
        x = tables.certifications.c
        query = sa.select(sa.func.max(x.id)).where(x.serial == serial, x.version == version)
        with self._database.reading() as connection:
            act = connection.scalar(query)
        return None if act is None else self._newest(CERTIFICATION.name, str(act))

    def _newest(self, kind: str, record: str) -> ManifestRow | None:
        m = tables.manifests.c
        query = sa.select(m.sequence, m.hash, m.act).where(m.kind == kind, m.record == record)
        with self._database.reading() as connection:
            row = connection.execute(query.order_by(m.sequence.desc()).limit(1)).first()
        return None if row is None or row.act != "sealed" else ManifestRow(int(row.sequence), str(row.hash))
