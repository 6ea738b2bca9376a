"""The tables of calibrations and certifications."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata

calibrations = sa.Table(
    "calibrations",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("parent", sa.Integer),
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id")),
    sa.Column("model", sa.String(200), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("hash", sa.String(64), nullable=False),
    sa.Column("document", sa.LargeBinary, nullable=False),
    sa.Column("answer", sa.JSON, nullable=False),
    sa.UniqueConstraint("serial", "version"),
)

#: All recordings that a version was fitted to; `recording_id` of the version is the newest of them.
calibration_recordings = sa.Table(
    "calibration_recordings",
    metadata,
    sa.Column("calibration_id", RowId, sa.ForeignKey("calibrations.id"), primary_key=True, autoincrement=False),
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True, autoincrement=False),
)

certifications = sa.Table(
    "certifications",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("act", sa.String(10), nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("due_at", Instant),
    sa.Column("verdict", sa.String(20)),
    sa.Column("verdict_recording", RowId),
    sa.Column("verdict_at", Instant),
    sa.Column("override", sa.Boolean),
    sa.Column("assessment", sa.JSON(none_as_null=True)),
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
    sa.Index(None, "serial", "id"),
)
