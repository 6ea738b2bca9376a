"""Certificates as they were issued, and their withdrawals."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata

#: As they were issued, in all three forms: a later release of labctl or typst changes none of them.
certificates = sa.Table(
    "certificates",
    metadata,
    id_column(),
    sa.Column("number", sa.String(100), nullable=False, unique=True),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("replaces", sa.String(100)),
    sa.Column("reason", sa.Text, nullable=False),  #: of an amendment; empty of the first
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100)),  #: API key of the one who issued it; absent: the name is as typed
    sa.Column("at", Instant, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("order", sa.JSON, nullable=False),  #: the facts that were given with the request
    sa.Column("document", sa.LargeBinary, nullable=False),
    sa.Column("xml", sa.LargeBinary, nullable=False),
    sa.Column("pdf", sa.LargeBinary, nullable=False),
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
    sa.UniqueConstraint("replaces"),
    sa.Index(None, "serial", "id"),
)

#: A certificate that is withdrawn stays so; rows are only ever added.
certificate_withdrawals = sa.Table(
    "certificate_withdrawals",
    metadata,
    id_column(),
    sa.Column("number", sa.String(100), sa.ForeignKey("certificates.number"), nullable=False, unique=True),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100)),  #: as of a certificate
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    #: The newest act on the version then: the revocation that withdrew it, or the certification that stays.
    sa.Column("certification_id", RowId, sa.ForeignKey("certifications.id")),
)
