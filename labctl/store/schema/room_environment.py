"""The table of the environment of the room: what a person typed or an instrument logged."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, id_column, metadata

room_environment = sa.Table(
    "room_environment",
    metadata,
    id_column(),
    sa.Column("measured_at", Instant, nullable=False),
    sa.Column("bench_name", sa.String(200), nullable=False),  #: empty: of all benches of the laboratory
    sa.Column("quantity", sa.String(20), nullable=False),
    sa.Column("unit", sa.String(10), nullable=False),
    sa.Column("value", sa.Float, nullable=False),
    sa.Column("source", sa.String(200), nullable=False),  #: the instrument, or the person who read it
    sa.Column("at", Instant, nullable=False),
    sa.Index(None, "measured_at"),
)
