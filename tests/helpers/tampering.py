"""Edits of a database by hand, as a person makes them who knows how labctl stores its records."""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import sqlalchemy as sa

from labctl.canonical_json import with_own_hash
from labctl.store import sample_codec
from labctl.store.connection.location import is_url
from labctl.store.manifests import chain
from labctl.store.manifests.contents import KINDS
from labctl.store.manifests.digests import block_digests
from labctl.store.manifests.parts import parts_of
from labctl.store.repositories import audit
from labctl.store.schema import tables as t

Edit = Callable[[sa.Connection], None]


@contextmanager
def by_hand(location: str) -> Iterator[sa.Connection]:
    """Give a connection without any of labctl's guards."""
    engine = sa.create_engine(location if is_url(location) else f"sqlite:///{location}")
    with engine.begin() as connection:
        yield connection
    engine.dispose()


def _rates(connection: sa.Connection) -> None:
    d = t.data_sets
    connection.execute(sa.update(d).values(table_rate_dps=d.c.table_rate_dps * 1.001))


def _warmer(connection: sa.Connection) -> None:
    """Add 5 K to every temperature: in blocks with a new checksum, in means, in set points and in the environment."""
    b, m, d, e = t.sample_blocks, t.data_set_means, t.data_sets, t.environment
    for row in connection.execute(sa.select(b)).all():
        columns = sample_codec.unpack(sample_codec.Block(row.n, row.codec, row.crc32, row.data))
        warm = {name for name in columns if "temperature" in name or name.startswith("chamber")}
        columns = {name: values + 5000 if name in warm else values for name, values in columns.items()}
        block = sample_codec.pack(columns, sample_codec.FINAL)
        assert block.crc32 == zlib.crc32(block.data)
        connection.execute(sa.update(b).where(b.c.id == row.id).values(data=block.data, crc32=block.crc32, n=block.n))
    warm_mean = m.c.channel.like("%temperature%") | m.c.channel.like("chamber%")
    connection.execute(sa.update(m).where(warm_mean).values(mean=m.c.mean + 5))
    connection.execute(sa.update(d).values(chamber_setpoint_c=d.c.chamber_setpoint_c + 5))
    connection.execute(sa.update(e).values(temperature_c=e.c.temperature_c + 5, chamber_c=e.c.chamber_c + 5))


def _mark(connection: sa.Connection) -> None:
    """Mark a data set, so that no fit takes it in."""
    d = t.data_sets.c
    connection.execute(sa.update(t.data_sets).where(d.recording_id == 1, d.number == 3).values(verification=True))


def _data_set(connection: sa.Connection) -> None:
    for table in (t.data_set_means, t.sample_blocks, t.block_digests, t.data_sets):
        connection.execute(sa.delete(table).where(table.c.recording_id == 1, table.c.number == 2))


def _events(connection: sa.Connection) -> None:
    connection.execute(sa.delete(t.events))


def _campaign_state(connection: sa.Connection) -> None:
    c = t.campaigns
    connection.execute(sa.update(c).where(c.c.id == 1).values(state="running", ended_at=None))


def _data_set_state(connection: sa.Connection) -> None:
    d = t.data_sets
    connection.execute(sa.update(d).where(d.c.recording_id == 1, d.c.number == 3).values(state="partial"))


def _document(connection: sa.Connection) -> None:
    c = t.calibrations
    row = connection.execute(sa.select(c.c.id, c.c.document)).first()
    assert row is not None
    document = json.loads(row.document)
    document["unit"]["model"] = "another"
    content, own = with_own_hash(document)
    connection.execute(sa.update(c).where(c.c.id == row.id).values(document=content, hash=own))


def _answer(connection: sa.Connection) -> None:
    c = t.calibrations
    row = connection.execute(sa.select(c.c.id, c.c.answer)).first()
    assert row is not None
    connection.execute(sa.update(c).where(c.c.id == row.id).values(answer={**row.answer, "edited": True}))


def _role(connection: sa.Connection) -> None:
    k = t.api_keys
    connection.execute(sa.update(k).where(k.c.role == "viewer").values(role="approver"))


def _last_audit_row(connection: sa.Connection) -> None:
    a, h = t.audit, t.audit_head
    row = connection.execute(sa.select(a).order_by(a.c.id.desc()).limit(1)).one()
    own = audit._hash(row.previous_hash, row.at, "somebody else", row.action, row.subject, row.detail)
    connection.execute(sa.update(a).where(a.c.id == row.id).values(actor="somebody else", hash=own))
    connection.execute(sa.update(h).values(hash=own))


#: The edit, and what the check has to say of it: kind or part of the check, and words.
EDITS: dict[str, tuple[Edit, str, str]] = {
    "rates": (_rates, "recording", "recording 1: table rates changed"),
    "temperatures": (_warmer, "recording", "recording 1: temperatures of the readings changed"),
    "data set": (_data_set, "recording", "recording 1: data sets changed"),
    "mark of a data set": (_mark, "recording", "recording 1: verification marks changed"),
    "events": (_events, "campaign", "campaign 1: events changed"),
    "state of campaign": (_campaign_state, "campaign", "campaign 1: state changed"),
    "state of data set": (_data_set_state, "recording", "recording 1: state of data sets changed"),
    "document": (_document, "calibration", "version 1: document changed"),
    "answer": (_answer, "calibration", "version 1: answer changed"),
    "role of a key": (_role, "key", "API key 'guest': role changed"),
    "last audit row": (_last_audit_row, "audit", "the audit trail was written anew"),
}


def write_chain_anew(connection: sa.Connection) -> None:
    """Make all fit again that is in the database: digests of blocks, parts, manifests, the chain and its head.

    Signatures stay as they are: their author does not have the key.
    """
    b, g, m = t.sample_blocks, t.block_digests, t.manifests
    connection.execute(sa.delete(g))
    for row in connection.execute(sa.select(b)).all():
        columns = sample_codec.unpack(sample_codec.Block(row.n, row.codec, row.crc32, row.data))
        place = {"recording_id": row.recording_id, "number": row.number, "seq": row.seq}
        connection.execute(sa.insert(g).values(**place, **block_digests(columns)))
    trail = list(connection.scalars(sa.select(t.audit.c.hash).order_by(t.audit.c.id)))
    previous = chain.FIRST
    rows = connection.execute(sa.select(m).order_by(m.c.sequence)).all()
    for row in rows:
        document = json.loads(row.document)
        document["previous"] = previous
        if document["audit"] and document["audit"]["length"]:
            document["audit"]["hash"] = trail[document["audit"]["length"] - 1]
        if row.kind and row.act == "sealed":
            document["parts"] = dict(parts_of(connection, KINDS[row.kind], row.record))
        content = chain.canonical(document)
        previous = hashlib.sha256(content).hexdigest()
        connection.execute(sa.update(m).where(m.c.sequence == row.sequence).values(document=content, hash=previous))
    connection.execute(sa.update(t.manifest_head).values(hash=previous))
