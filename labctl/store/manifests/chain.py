"""The chain of manifests: rows are only ever added, each holds the hash of the one before and the audit trail's head.

A transaction that writes to the audit trail ends with a manifest, of a record or of the trail alone, so that the last
row of the trail cannot be written anew either.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

import sqlalchemy as sa

from labctl.answers.json_object import JsonObject
from labctl.canonical_json import canonical
from labctl.store.schema import tables

SCHEMA = "labctl-manifest/1"
FIRST = "0" * 64
HEAD_ID = 1
Act = Literal["sealed", "reopened", "audit"]

_GROWN, _AUDITED = "labctl.manifests", "labctl.audited"


@dataclass(frozen=True)
class ChainHead:
    """How many manifests there are, and the hash of the last."""

    length: int
    hash: str

    def __str__(self) -> str:
        return f"{self.length}:{self.hash}"


@dataclass(frozen=True)
class Manifest:
    """What a manifest says of one record."""

    kind: str
    record: str
    title: str
    act: Act
    reason: str
    parts: Mapping[str, JsonObject]
    unfit: Sequence[str] = ()  #: parts that did not fit the manifest before when the record was next changed
    supersedes: int | None = None


def begin(connection: sa.Connection) -> None:
    """Take note that a transaction begins on a connection."""
    connection.info.pop(_GROWN, None)
    connection.info.pop(_AUDITED, None)


def note_audit_row(connection: sa.Connection, at: datetime) -> None:
    """Take note that the open transaction has added to the audit trail."""
    connection.info[_AUDITED] = at


def finish(connection: sa.Connection) -> ChainHead | None:
    """Bind what the open transaction added to the audit trail; returns the new head, None where nothing was added."""
    at: datetime | None = connection.info.pop(_AUDITED, None)
    if at is not None:
        append(connection, at, Manifest("", "", "audit trail", "audit", "", {}))
    grown: ChainHead | None = connection.info.pop(_GROWN, None)
    return grown


def append(connection: sa.Connection, at: datetime, manifest: Manifest) -> ChainHead:
    """Add a manifest to the chain, inside the transaction of the act that it is about."""
    m, h = tables.manifests, tables.manifest_head
    last_entry = connection.execute(sa.select(h.c.length, h.c.hash).where(h.c.id == HEAD_ID).with_for_update()).first()
    before = ChainHead(int(last_entry.length), str(last_entry.hash)) if last_entry is not None else last(connection)
    length = before.length + 1
    document = canonical(_document(connection, at, manifest, length, before.hash))
    digest = hash_of(document)
    connection.execute(
        sa.insert(m).values(
            sequence=length,
            kind=manifest.kind,
            record=manifest.record,
            act=manifest.act,
            hash=digest,
            document=document,
        )
    )
    if last_entry is not None:  # a head that was removed is never made again: the check reports that it is missing
        connection.execute(sa.update(h).where(h.c.id == HEAD_ID).values(length=length, hash=digest))
    head = ChainHead(length, digest)
    connection.info[_GROWN] = head
    connection.info.pop(_AUDITED, None)
    return head


def _document(
    connection: sa.Connection, at: datetime, manifest: Manifest, sequence: int, previous: str
) -> dict[str, object]:
    a = tables.audit_head.c
    trail = connection.execute(sa.select(a.length, a.hash)).first()
    document: dict[str, object] = {
        "schema": SCHEMA,
        "sequence": sequence,
        "previous": previous,
        "at": at.astimezone(UTC).isoformat(),
        "act": manifest.act,
        "audit": None if trail is None else {"length": int(trail.length), "hash": str(trail.hash)},
    }
    if manifest.kind:
        document |= {
            "kind": manifest.kind, "record": manifest.record, "title": manifest.title, "reason": manifest.reason,
            "parts": dict(manifest.parts), "supersedes": manifest.supersedes,
        }  # fmt: skip
        if manifest.unfit:
            document["unfit"] = list(manifest.unfit)
    return document


def hash_of(document: bytes) -> str:
    """Return the hash of a manifest, which the next one holds and a signature is over."""
    return hashlib.sha256(document).hexdigest()


def last(connection: sa.Connection) -> ChainHead:
    """Return the end of the chain by its rows."""
    m = tables.manifests.c
    row = connection.execute(sa.select(m.sequence, m.hash).order_by(m.sequence.desc()).limit(1)).first()
    return ChainHead(0, FIRST) if row is None else ChainHead(int(row.sequence), str(row.hash))


def head_of(connection: sa.Connection) -> ChainHead | None:
    """Return what the head says; None when it was removed."""
    h = tables.manifest_head.c
    row = connection.execute(sa.select(h.length, h.hash).where(h.id == HEAD_ID)).first()
    return None if row is None else ChainHead(int(row.length), str(row.hash))
