"""Sealing: a record that is at rest has a manifest; what changes it afterwards, for a reason, makes a new one.

A record that did not fit its manifest before such a change is not made good by it: the new manifest names what did not
fit, and the check goes on reporting it.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.errors import StoreError
from labctl.store.connection.database import Database
from labctl.store.manifests import chain
from labctl.store.manifests.contents import CAMPAIGN, KINDS, RECORDING, Kind
from labctl.store.manifests.parts import Parts, differing, parts_of
from labctl.store.schema import tables

#: Kind and key of a record.
Record = tuple[str, str]
Prepared = Mapping[Record, Parts]


@dataclass(frozen=True)
class Newest:
    """The newest manifest of a record."""

    sequence: int
    hash: str
    is_sealed: bool
    parts: Parts


def newest(connection: sa.Connection, record: Record) -> Newest | None:
    """Return the newest manifest of a record; None where it has none."""
    m = tables.manifests.c
    query = sa.select(m.sequence, m.hash, m.act, m.document).where(m.kind == record[0], m.record == record[1])
    row = connection.execute(query.order_by(m.sequence.desc()).limit(1)).first()
    if row is None:
        return None
    try:
        parts = json.loads(bytes(row.document)).get("parts", {})
    except (ValueError, AttributeError):  # written by another program: nothing fits it
        parts = {"manifest": {}}
    return Newest(int(row.sequence), str(row.hash), row.act == "sealed", parts)


def seal(connection: sa.Connection, record: Record, at: datetime, reason: str, parts: Parts | None = None) -> None:
    """Seal a record that is new; `parts` are its digests where they are known already."""
    kind = KINDS[record[0]]
    parts = parts_of(connection, kind, record[1]) if parts is None else parts
    title = _title(connection, kind, record[1])
    chain.append(connection, at, chain.Manifest(kind.name, record[1], title, "sealed", reason, parts))


@contextmanager
def changing(
    connection: sa.Connection, records: Sequence[Record], at: datetime, reason: str, prepared: Prepared | None = None
) -> Iterator[None]:
    """Change records inside the block: one that is at rest afterwards is sealed, one that was sealed is reopened.

    `prepared` has the digests of records whose own rows the block does not change.
    """
    prepared = prepared or {}
    before = {record: newest(connection, record) for record in records}
    unfit = {record: _unfit(connection, record, was, prepared) for record, was in before.items()}
    yield
    for record, was in before.items():
        kind = KINDS[record[0]]
        at_rest = _is_at_rest(connection, kind, record[1])
        if not at_rest and (was is None or not was.is_sealed):
            continue
        parts = _parts(connection, record, prepared) if at_rest else {}
        act: chain.Act = "sealed" if at_rest else "reopened"
        title = _title(connection, kind, record[1])
        supersedes = None if was is None else was.sequence
        manifest = chain.Manifest(kind.name, record[1], title, act, reason, parts, unfit[record], supersedes)
        chain.append(connection, at, manifest)


def _unfit(connection: sa.Connection, record: Record, was: Newest | None, prepared: Prepared) -> list[str]:
    if was is None or not was.is_sealed:
        return []
    return differing(was.parts, _parts(connection, record, prepared))


def _parts(connection: sa.Connection, record: Record, prepared: Prepared) -> Parts:
    try:
        return prepared[record] if record in prepared else parts_of(connection, KINDS[record[0]], record[1])
    except (StoreError, ValueError, TypeError) as error:  # damaged: it must not keep a campaign from ending
        return {"content": {"unreadable": " ".join(str(error).split())}}


def _is_at_rest(connection: sa.Connection, kind: Kind, record: str) -> bool:
    key = kind.table.c[kind.key]
    query = sa.select(key).where(key == kind.key_of(record), kind.whole(), kind.at_rest())
    return connection.execute(query).first() is not None


def _title(connection: sa.Connection, kind: Kind, record: str) -> str:
    c = kind.table.c
    query = sa.select(*(c[name] for name in kind.titled.split())).where(c[kind.key] == kind.key_of(record))
    return kind.title(connection.execute(query).one())


def of_campaign(connection: sa.Connection, campaign: int) -> list[Record]:
    """Return a campaign and its recordings as records."""
    r = tables.recordings.c
    recordings = connection.scalars(sa.select(r.id).where(r.campaign_id == campaign).order_by(r.id))
    return [(RECORDING.name, str(number)) for number in recordings] + [(CAMPAIGN.name, str(campaign))]


def sealed_at(connection: sa.Connection, campaign: int) -> datetime | None:
    """Return when a campaign that is sealed was ended; None for one that may go on."""
    was = newest(connection, (CAMPAIGN.name, str(campaign)))
    if was is None or not was.is_sealed:
        return None
    c = tables.campaigns.c
    row = connection.execute(sa.select(c.ended_at, c.created_at).where(c.id == campaign)).one()
    sealed: datetime = row.ended_at or row.created_at
    return sealed


def prepared_recordings(database: Database, records: Sequence[Record]) -> Prepared:
    """Return the digests of recordings, read before a transaction so that nothing waits for it."""
    with database.reading() as connection:
        return {
            record: _parts(connection, record, {}) for record in records if record[0] == RECORDING.name
        }  # fmt: skip
