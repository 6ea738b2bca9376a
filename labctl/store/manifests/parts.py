"""The digests of the parts of a record, as it is in the database now."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import sqlalchemy as sa

from labctl.answers.json_object import JsonObject
from labctl.store.manifests.contents import KINDS, Kind
from labctl.store.manifests.digests import GROUPS, RowsDigest, block_digests, digest_of_rows
from labctl.store.schema import tables

#: Rows that are in memory at a time.
AT_ONCE = 2000
#: The parts of a recording that its blocks are, by their group.
BLOCK_PARTS = {
    "readings": "readings",
    "temperatures": "temperatures of the readings",
    "table_rates": "table rates of the readings",
}
Parts = Mapping[str, JsonObject]


class BlockParts:
    """Takes the digests of a recording's blocks, in the order of number and seq."""

    def __init__(self) -> None:
        self._made = {group: RowsDigest() for group in GROUPS}

    def take(self, number: int, seq: int, n: int, digests: Mapping[str, str]) -> None:
        """Take one block of `n` readings."""
        for group, part in self._made.items():
            part.take((number, seq, n, digests[group]))

    def parts(self) -> Parts:
        """Return the digests by the names of their parts."""
        return {BLOCK_PARTS[group]: part.digest().as_json() for group, part in self._made.items()}


def parts_of(connection: sa.Connection, kind: Kind, record: str, *, blocks: bool = True) -> Parts:
    """Return the digest of every part of a record; those of blocks, unless left out, by what is kept of them."""
    key = kind.key_of(record)
    contents: dict[str, JsonObject] = {}
    for part in kind.parts:
        rows: Iterable[sa.Row[*tuple[object, ...]]] = connection.execute(
            part.query(key).execution_options(yield_per=AT_ONCE)
        )
        contents[part.name] = digest_of_rows(rows).as_json()
    return {**contents, **(_block_parts(connection, int(key)) if kind.has_blocks and blocks else {})}


def _block_parts(connection: sa.Connection, recording: int) -> Parts:
    b, d = tables.sample_blocks.c, tables.block_digests.c
    same = sa.and_(d.recording_id == b.recording_id, d.number == b.number, d.seq == b.seq)
    query = (
        sa.select(b.number, b.seq, b.n, d.readings, d.temperatures, d.table_rates)
        .select_from(tables.sample_blocks.outerjoin(tables.block_digests, same))
        .where(b.recording_id == recording)
        .order_by(b.number, b.seq)
    )
    block_parts = BlockParts()
    for number, seq, n, *digests in connection.execute(query).all():
        if digests[0] is None:  # of a data set that was never closed
            block_parts.take(number, seq, n, _digests_of_block(connection, recording, number, seq))
        else:
            block_parts.take(number, seq, n, dict(zip(GROUPS, digests, strict=True)))
    return block_parts.parts()


def _digests_of_block(connection: sa.Connection, recording: int, number: int, seq: int) -> Mapping[str, str]:
    b = tables.sample_blocks.c
    query = sa.select(b.n, b.codec, b.crc32, b.data).where(
        b.recording_id == recording, b.number == number, b.seq == seq
    )
    from labctl.store import sample_codec  # noqa: PLC0415  loads numpy, and few blocks are without digests

    return block_digests(sample_codec.unpack(sample_codec.Block(*connection.execute(query).one())))


#: Parts of which a record that was sealed before they existed had no rows, and what each was then.
_LATER = frozenset(part.name for kind in KINDS.values() for part in kind.parts if part.was_empty)
_NOTHING: JsonObject = digest_of_rows(()).as_json()


def differing(sealed: Parts, now: Parts) -> list[str]:
    """Return the names of the parts that are not what they were.

    A record that was sealed before a part with `was_empty` existed had nothing of it. Other parts that only one of both
    has are not compared.
    """
    before = dict.fromkeys(_LATER & set(now), _NOTHING) | dict(sealed)
    return [name for name, digest in before.items() if name in now and dict(now[name]) != dict(digest)]
