"""Is every record what it was when it was sealed, and is the chain of manifests whole?"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import sqlalchemy as sa

from labctl.errors import StoreError
from labctl.public_keys import PublicKey
from labctl.store.manifests import chain
from labctl.store.manifests.chain import ChainHead
from labctl.store.manifests.contents import KINDS, Kind
from labctl.store.manifests.parts import BlockParts, Parts, differing, parts_of
from labctl.store.schema import tables

#: Manifests that are in memory at a time.
AT_ONCE = 500
_NO_BLOCKS = BlockParts().parts()

Find = Callable[[str, str], None]
Record = tuple[str, str]


@dataclass(frozen=True)
class _Sealed:
    """The newest manifest of a record, as far as it is compared."""

    sequence: int
    title: str
    act: str
    at: str
    reason: str
    parts: Parts


@dataclass
class Chain:
    """The chain as it was read."""

    head: ChainHead = field(default_factory=lambda: ChainHead(0, chain.FIRST))
    newest: dict[Record, _Sealed] = field(default_factory=dict)
    signed: int = 0  #: how many manifests the last signature covers that fits; without a key, that is there
    keys: set[str] = field(default_factory=set)  #: fingerprints that signatures name
    trail: int = 0  #: how many rows of the audit trail the last manifest covers
    not_sealed: int = 0


class ManifestCheck:
    """Checks the chain, then every record against its newest manifest."""

    def __init__(self, connection: sa.Connection, find: Find, keys: Sequence[PublicKey] = ()) -> None:
        self._connection = connection
        self._find = find
        self._keys: Mapping[str, PublicKey] = {key.fingerprint: key for key in keys}
        self.chain = Chain()

    def check_chain(self, anchors: Mapping[str, ChainHead], *, trail_fits: bool) -> None:
        """Read the chain; `anchors` are heads that were noted down elsewhere, by where that is."""
        trail = list(self._connection.scalars(sa.select(tables.audit.c.hash).order_by(tables.audit.c.id)))
        name_by_head = {(head.length, head.hash): source for source, head in anchors.items()}
        hashes: dict[int, str] = {}
        for row, document in self._rows():
            checked_chain = self.chain
            if (sequence := int(row.sequence)) != checked_chain.head.length + 1:
                self._find("manifests", f"manifests before manifest {sequence} are missing: the chain has a gap")
            for text in _misfits(row, document, checked_chain.head.hash):
                self._find("manifests", f"manifest {sequence} {text}")
            self._take(row, document)
            self._verify(row)
            if trail_fits and not _fits_trail(document, trail):
                trail_fits = False
                self._find("audit", f"the audit trail was written anew: it does not fit manifest {sequence}")
            if any(length == sequence for length, _ in name_by_head):
                hashes[sequence] = str(row.hash)
        if trail_fits and self.chain.trail < len(trail):
            text = f"the last {len(trail) - self.chain.trail} rows of the audit trail are in no manifest"
            self._find("audit", f"{text}: they were added without labctl, or manifests were removed")
        self._check_end(name_by_head, hashes)
        self._check_signed()

    def _rows(self) -> Iterator[tuple[sa.Row[*tuple[Any, ...]], Mapping[str, Any]]]:
        m = tables.manifests.c
        query = sa.select(m.sequence, m.kind, m.record, m.act, m.hash, m.document, m.signature, m.signed_by)
        for row in self._connection.execute(query.order_by(m.sequence).execution_options(yield_per=AT_ONCE)):
            try:
                document = json.loads(row.document)
            except (ValueError, TypeError):
                document = None
            yield row, document if isinstance(document, dict) else {}

    def _take(self, row: sa.Row[*tuple[Any, ...]], document: Mapping[str, Any]) -> None:
        checked_chain = self.chain
        checked_chain.head = ChainHead(int(row.sequence), str(row.hash))
        checked_chain.trail = max(checked_chain.trail, (document.get("audit") or {}).get("length", 0))
        if not row.kind:
            return
        sealed = _Sealed(
            int(row.sequence), str(document.get("title") or f"{row.kind} {row.record}"), str(row.act),
            str(document.get("at", "")), str(document.get("reason", "")), document.get("parts") or {},
        )  # fmt: skip
        checked_chain.newest[(row.kind, row.record)] = sealed
        for name in document.get("unfit", ()):
            text = f"{name} had been changed by hand before it was changed in order on {sealed.at[:10]}"
            self._find(row.kind, f"{sealed.title}: {text} (manifest {sealed.sequence}, {sealed.reason})")

    def _verify(self, row: sa.Row[*tuple[Any, ...]]) -> None:
        if row.signature is None:
            return
        self.chain.keys.add(str(row.signed_by))
        key = self._keys.get(str(row.signed_by))
        if key is not None and not key.fits(row.signature, str(row.hash)):
            self._find("manifests", f"manifest {row.sequence}: its signature does not fit")
        elif key is not None or not self._keys:
            self.chain.signed = int(row.sequence)

    def _check_end(self, expected: Mapping[tuple[int, str], str], hashes: Mapping[int, str]) -> None:
        computed, stored_head = self.chain.head, chain.head_of(self._connection)
        if stored_head is None:
            self._find("manifests", "the head of the chain, which counts the manifests, is missing")
        elif stored_head.length > computed.length:
            self._find("manifests", f"the last {stored_head.length - computed.length} manifests are missing")
        elif stored_head != computed:
            self._find("manifests", "the last manifest is not the one that the head of the chain names")
        for (length, digest), source in expected.items():
            if length > computed.length:
                self._find(
                    "manifests",
                    f"{length - computed.length} manifests that {source} counts are missing: the end of the chain was "
                    "removed, or an older copy of the database was put in its place",
                )
            elif hashes.get(length) != digest:
                self._find(
                    "manifests", f"manifest {length} is not the one that {source} names: the chain was rewritten"
                )

    def _check_signed(self) -> None:
        last, total = self.chain.signed, self.chain.head.length
        if self._keys and last < total:
            which = f"manifest {total} is" if last + 1 == total else f"manifests {last + 1} to {total} are"
            self._find(
                "manifests",
                f"{which} not signed by the key that was given: every user who can write to the database may "
                "have written them; `labctl seal-key sign` signs them, if it is as it should be",
            )

    def check_records(self, blocks: Mapping[int, Parts | None]) -> None:
        """Compare every record; `blocks` are the digests of recordings' blocks, None where a block is damaged."""
        for kind in KINDS.values():
            self._check_kind(kind, blocks)
        for (name, _), sealed in self.chain.newest.items():
            if name in KINDS:
                self._find(
                    name, f"{sealed.title} is missing: it was sealed on {sealed.at[:10]} (manifest {sealed.sequence})"
                )

    def _check_kind(self, kind: Kind, blocks: Mapping[int, Parts | None]) -> None:
        key = kind.table.c[kind.key]
        at_rest = set(self._connection.scalars(sa.select(key).where(kind.whole(), kind.at_rest())))
        for record in self._connection.scalars(sa.select(key).where(kind.whole()).order_by(key)).all():
            sealed = self.chain.newest.pop((kind.name, str(record)), None)
            if sealed is not None and sealed.act == "sealed":
                for text in self._differing(kind, str(record), sealed, blocks):
                    self._find(kind.name, f"{sealed.title}: {text} (manifest {sealed.sequence}, {sealed.reason})")
            elif record in at_rest:
                seal_text = "was never sealed" if sealed is None else "was reopened, and has ended without being sealed"
                self._find(kind.name, f"{kind.name} {record} {seal_text}: it was made or changed without labctl")
            else:
                self.chain.not_sealed += 1

    def _differing(self, kind: Kind, record: str, sealed: _Sealed, blocks: Mapping[int, Parts | None]) -> Iterator[str]:
        try:
            now = dict(parts_of(self._connection, kind, record, blocks=False))
        except (StoreError, ValueError, TypeError, ArithmeticError) as error:
            yield f"it cannot be read ({error}), and could be when it was sealed on {sealed.at[:10]}"
            return
        if kind.has_blocks:
            now |= blocks.get(int(record), _NO_BLOCKS) or {}
        for name in differing(sealed.parts, now):
            was, rows = sealed.parts[name].get("rows"), now[name].get("rows")
            number = f" ({rows} rows, {was} then)" if was != rows else ""
            yield f"{name} changed{number} since it was sealed on {sealed.at[:10]}"


def _misfits(row: sa.Row[*tuple[Any, ...]], document: Mapping[str, Any], previous: str) -> Iterator[str]:
    content = row.document.encode() if isinstance(row.document, str) else bytes(row.document)  # another program's
    if chain.hash_of(content) != row.hash:
        yield "was changed: its hash does not fit"
    elif document.get("previous") != previous:
        yield "does not follow the one before: the chain was changed"
    elif (row.sequence, row.act) != (document.get("sequence"), document.get("act")):
        yield "was moved"
    elif (row.kind, row.record) != (document.get("kind", ""), document.get("record", "")):
        yield "was given to another record"


def _fits_trail(document: Mapping[str, Any], trail: Sequence[str]) -> bool:
    audit_entry = document.get("audit")
    if not isinstance(audit_entry, dict) or not audit_entry.get("length"):
        return True
    length = audit_entry["length"]
    return isinstance(length, int) and length <= len(trail) and trail[length - 1] == audit_entry.get("hash")
