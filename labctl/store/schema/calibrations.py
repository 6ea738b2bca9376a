"""The tables of calibrations, of their certifications and releases, and of who fetched them."""

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
    sa.Column("by_key", sa.String(100)),  #: API key of the one who acted; absent: the name is as typed
    sa.Column("request_id", RowId),  #: the request that a second person released; absent: none was needed
    sa.Column("released_by", sa.String(200)),
    sa.Column("released_key", sa.String(100)),
    sa.Column("release_reason", sa.Text),
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
    sa.Index(None, "serial", "id"),
)

#: What a first person asked to certify where a second one has to release it; rows are only ever added.
release_requests = sa.Table(
    "release_requests",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), nullable=False),
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100), nullable=False),
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Column("due_days", sa.Integer),
    sa.Column("override", sa.Boolean, nullable=False),
    sa.Column("after_act", RowId, nullable=False),  #: newest act on the version then; 0: none. A later one ends it
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
    sa.Index(None, "serial", "id"),
)

#: Who fetched a version over HTTP: a row for each key, and one for all who sent none.
calibration_fetches = sa.Table(
    "calibration_fetches",
    metadata,
    sa.Column("serial", sa.String(200), primary_key=True),
    sa.Column("version", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("who", sa.String(100), primary_key=True),
    sa.Column("first_at", Instant, nullable=False),
    sa.Column("last_at", Instant, nullable=False),
    sa.ForeignKeyConstraint(["serial", "version"], ["calibrations.serial", "calibrations.version"]),
)
