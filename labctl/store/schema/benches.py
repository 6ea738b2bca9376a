"""Benches, who drives each at present, and the air of the laboratory around them."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, id_column, metadata

benches = sa.Table(
    "benches",
    metadata,
    sa.Column("name", sa.String(200), primary_key=True),
    sa.Column("file", sa.JSON, nullable=False),
    sa.Column("last_used_at", Instant, nullable=False),
    sa.Column(
        "unconfirmed", sa.Text, nullable=False, server_default=""
    ),  #: what the safe state could not confirm; until a person clears it
    sa.Column("unconfirmed_at", Instant),
    sa.Column("attempts", sa.Integer, nullable=False, server_default="0"),  #: at the safe state, since then
    sa.Column("attempted_at", Instant),
    sa.Column("confirmed_at", Instant),  #: when such an attempt confirmed it; a person has still to look
)

leases = sa.Table(
    "leases",
    metadata,
    sa.Column("bench_name", sa.String(200), primary_key=True),
    sa.Column("owner", sa.String(32), nullable=False),
    sa.Column("host", sa.String(200), nullable=False),
    sa.Column("machine", sa.String(200), nullable=False),
    sa.Column("pid", sa.BigInteger, nullable=False),
    sa.Column("since", Instant, nullable=False),
    sa.Column("beat", sa.BigInteger, nullable=False),
    sa.Column("beat_at", Instant, nullable=False),
    sa.Column("expires_at", Instant, nullable=False),
    sa.Column("url", sa.Text),  #: of the service that drives the bench; null where a terminal does
    sa.Column("calls", sa.Text),  #: folder of the Unix sockets of its bench process
)

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
