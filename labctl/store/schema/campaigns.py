"""The tables of campaigns, their steps and events."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, StateOfCampaign, campaign_column, id_column, metadata

campaigns = sa.Table(
    "campaigns",
    metadata,
    id_column(),
    sa.Column("recipe_name", sa.String(200), nullable=False),
    sa.Column("recipe", sa.JSON, nullable=False),
    sa.Column("bench_name", sa.String(200), sa.ForeignKey("benches.name"), nullable=False),
    sa.Column("bench", sa.JSON, nullable=False),
    sa.Column("schedule_hash", sa.String(64), nullable=False),
    sa.Column("expected_s", sa.Float, nullable=False),
    sa.Column("state", StateOfCampaign, nullable=False),
    sa.Column("reason", sa.Text, nullable=False, default=""),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("started_at", Instant),
    sa.Column("ended_at", Instant),
    sa.Column("added_runs", sa.Integer, nullable=False, server_default="0"),  #: powered sessions beyond the plan's
    sa.Column("powered_on_s", sa.Float),  #: when the present session began, campaign time
    sa.Column("boot_id", sa.String(64)),  #: of the host that runs it: another one means that the power failed
)

steps = sa.Table(
    "steps",
    metadata,
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id"), primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("kind", sa.String(20), nullable=False),
    sa.Column("body", sa.JSON, nullable=False),
    sa.Column("expected_s", sa.Float, nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("started_s", sa.Float),
    sa.Column("ended_s", sa.Float),
    sa.Column("started_at", Instant),
    sa.Column("ended_at", Instant),
    sa.Column("result", sa.JSON(none_as_null=True)),
)

events = sa.Table(
    "events",
    metadata,
    id_column(),
    campaign_column(),
    sa.Column("at", Instant, nullable=False),
    sa.Column("t_s", sa.Float, nullable=False),
    sa.Column("kind", sa.String(60), nullable=False),
    sa.Column("level", sa.String(10), nullable=False),
    sa.Column("message", sa.Text, nullable=False),
    sa.Column("device", sa.String(100)),
    sa.Column("value", sa.Float),
    sa.Column("limit_value", sa.Float),
    sa.Column("unit", sa.String(20)),
    sa.Index(None, "campaign_id", "id"),
)

timed_runs = sa.Table(
    "timed_runs",
    metadata,
    id_column(),
    campaign_column(),
    sa.Column("session", sa.Integer, nullable=False),  #: of the process and its link to the table
    sa.Column("block", sa.Integer, nullable=False),  #: runs that were made one after the other
    sa.Column("t_s", sa.Float, nullable=False),  #: campaign time of its middle
    sa.Column("nominal_s", sa.Float, nullable=False),  #: time that its steps take at the nominal step rate
    sa.Column("duration_s", sa.Float, nullable=False),
    sa.Column("step_hz", sa.Float, nullable=False),  #: nominal step rate
    sa.Column("used", sa.Boolean, nullable=False),  #: whether the rates of the data sets are by it, too
    sa.Index(None, "campaign_id", "id"),
)
