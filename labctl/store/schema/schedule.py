"""Campaigns that are to begin later, and what became of their starts."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata

#: Campaigns that are to begin later. `due_at` is the next start; a single start keeps its time once it is over.
scheduled_starts = sa.Table(
    "scheduled_starts",
    metadata,
    id_column(),
    sa.Column("bench_name", sa.String(200), nullable=False),
    sa.Column("recipe_name", sa.String(200), nullable=False),
    sa.Column("recipe", sa.Text, nullable=False),
    sa.Column("clip", sa.Boolean, nullable=False),
    sa.Column("priority", sa.Integer, nullable=False),
    sa.Column("cron", sa.String(200)),
    sa.Column("time_zone", sa.String(100), nullable=False),
    sa.Column("late_limit_s", sa.Float),
    sa.Column("due_at", Instant, nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("confirmed_by", sa.String(200)),  # who confirmed that the bench will be clear
    sa.Column("visits_s", sa.JSON),  # when the plan needs a person, s from its begin
    sa.Column("hide", sa.JSON(none_as_null=True)),  # effects hidden in the units of a simulated bench
    sa.Column("fit", sa.Boolean, nullable=False, server_default=sa.true()),  # whether it ends in a draft
    sa.Index(None, "bench_name", "state", "due_at"),
)

#: What became of each start that fell due. `after_campaign` is the newest campaign at the time it was claimed.
start_events = sa.Table(
    "start_events",
    metadata,
    id_column(),
    sa.Column("start_id", RowId, sa.ForeignKey("scheduled_starts.id"), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("due_at", Instant, nullable=False),
    sa.Column("outcome", sa.String(20), nullable=False),
    sa.Column("message", sa.Text, nullable=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id")),
    sa.Column("after_campaign", RowId, nullable=False),
    sa.Index(None, "start_id", "id"),
)
