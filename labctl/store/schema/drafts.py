"""Drafts: the calibrations that campaigns end in."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, metadata

#: Written with the plan of a campaign whose recipe has [fit]. State: due, fitted (the version is kept, its report is
#: not), made, failed.
drafts = sa.Table(
    "drafts",
    metadata,
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True, autoincrement=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id"), nullable=False),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("version", sa.Integer),
    sa.Column("at", Instant),
    sa.Column("reason", sa.Text, nullable=False, server_default=""),  #: why there is none
    sa.Column("report", sa.JSON(none_as_null=True)),
    sa.Index(None, "campaign_id"),
    sa.Index(None, "serial", "recording_id"),
    sa.Index(None, "state"),
)
