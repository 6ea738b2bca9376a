"""API keys."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, metadata

#: A key itself is never kept. Names are not used twice, so that a name in the audit trail stays one key.
api_keys = sa.Table(
    "api_keys",
    metadata,
    sa.Column("name", sa.String(100), primary_key=True),
    sa.Column("role", sa.String(20), nullable=False),
    sa.Column("digest", sa.String(64), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("revoked_at", Instant),
    sa.UniqueConstraint("digest"),
)
