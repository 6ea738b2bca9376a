"""Manifests of sealed records, and digests of the readings."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import RowId, metadata

#: Rows are only ever added, numbered from 1 without a gap; `document` holds the hash of the row before.
manifests = sa.Table(
    "manifests",
    metadata,
    sa.Column("sequence", RowId, primary_key=True, autoincrement=False),
    sa.Column("kind", sa.String(20), nullable=False),  #: of the record; empty where only the audit trail grew
    sa.Column("record", sa.String(300), nullable=False),
    sa.Column("act", sa.String(10), nullable=False),  #: sealed, reopened, audit
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("document", sa.LargeBinary, nullable=False),
    sa.Column("signature", sa.LargeBinary),  #: over the hash, and so over all rows before; absent: not signed by itself
    sa.Column("signed_by", sa.String(64)),  #: fingerprint of the public key
    sa.Index(None, "kind", "record", "sequence"),
)

#: One row: how many manifests there are and the hash of the last, so that removing the last ones shows.
manifest_head = sa.Table(
    "manifest_head",
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("length", sa.BigInteger, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
)

#: Digests of the columns of a block of readings, made when it is packed for good: sealing need not unpack it again.
block_digests = sa.Table(
    "block_digests",
    metadata,
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True, autoincrement=False),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("seq", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("readings", sa.String(64), nullable=False),
    sa.Column("temperatures", sa.String(64), nullable=False),
    sa.Column("table_rates", sa.String(64), nullable=False),
)
