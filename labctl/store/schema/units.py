"""Units: gyros by serial number."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, metadata

units = sa.Table(
    "units",
    metadata,
    sa.Column("serial", sa.String(200), primary_key=True),
    sa.Column("model", sa.String(200), nullable=False),
    sa.Column("technology", sa.String(20)),
    sa.Column("first_seen_at", Instant, nullable=False),
    sa.Column("batch", sa.String(100), nullable=False, default="", server_default=""),
    sa.Column("supplier", sa.String(200), nullable=False, default="", server_default=""),
    sa.Index(None, "batch"),
)
