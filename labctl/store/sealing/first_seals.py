"""The manifests of a database that had none: made at its migration, and said to be."""

from __future__ import annotations

from datetime import datetime

import sqlalchemy as sa

from instruments.clock import SystemClock
from labctl.errors import StoreError
from labctl.store import sample_codec
from labctl.store.manifests import chain
from labctl.store.manifests.contents import KINDS, Kind
from labctl.store.manifests.digests import block_digests
from labctl.store.manifests.parts import Parts, parts_of
from labctl.store.schema import tables
from labctl.store.sealing.seals import seal

#: Blocks and records that are read at a time.
AT_ONCE = 64
#: The schema at which the first manifests are made.
SCHEMA = "0017"


def seal_all(connection: sa.Connection) -> None:
    """Seal every record that is at rest, a block at a time, in the transaction of `connection`.

    Tables and columns of later schemas are not there yet.
    """
    at = SystemClock().utc()
    reason = f"sealed by migration on {at:%Y-%m-%d}"
    chain.begin(connection)
    _digest_blocks(connection)
    for kind in KINDS.values():
        if kind.since <= SCHEMA:
            _seal_kind(connection, kind.as_of(SCHEMA), at, reason)
    if connection.execute(sa.select(tables.audit.c.id).limit(1)).first() is not None:
        chain.note_audit_row(connection, at)
    chain.finish(connection)


def _seal_kind(connection: sa.Connection, kind: Kind, at: datetime, reason: str) -> None:
    key = kind.table.c[kind.key]
    records = sa.select(key).where(kind.whole(), kind.at_rest()).order_by(key)
    for record in connection.scalars(records).all():
        seal(connection, (kind.name, str(record)), at, reason, _parts(connection, kind, str(record)))


def _parts(connection: sa.Connection, kind: Kind, record: str) -> Parts:
    try:
        return parts_of(connection, kind, record)
    except StoreError as error:  # a block that is damaged already prevents no migration; the check reports it
        return {
            **parts_of(connection, kind, record, blocks=False),
            "readings": {"unreadable": str(error)},
        }


def _digest_blocks(connection: sa.Connection) -> None:
    b, last = tables.sample_blocks.c, 0
    query = sa.select(b.id, b.recording_id, b.number, b.seq, b.n, b.codec, b.crc32, b.data)
    while rows := connection.execute(query.where(b.id > last).order_by(b.id).limit(AT_ONCE)).all():
        digests = []
        for row in rows:
            try:
                columns = sample_codec.unpack(sample_codec.Block(row.n, row.codec, row.crc32, row.data))
            except StoreError:
                continue
            place = {"recording_id": row.recording_id, "number": row.number, "seq": row.seq}
            digests.append({**place, **block_digests(columns)})
        if digests:
            connection.execute(sa.insert(tables.block_digests), digests)
        last = rows[-1].id
