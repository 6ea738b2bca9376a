"""Fleet jobs: a fit or a criticism of many units, what came of each unit, and the coefficients of the newest fits."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata

#: State: waiting, running, done, cancelled, failed.
fleet_jobs = sa.Table(
    "fleet_jobs",
    metadata,
    id_column(),
    sa.Column("kind", sa.String(20), nullable=False),  #: fit or criticise
    sa.Column("request", sa.JSON, nullable=False),  #: which units, and what is done with each
    sa.Column("engine", sa.String(300), nullable=False),  #: local, or the address of a scheduler
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("units", sa.Integer, nullable=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("runner", sa.String(200), nullable=False, server_default=""),  #: process that carries it out
    sa.Column("seen_at", Instant),  #: last sign of life of that process
    sa.Column("started_at", Instant),
    sa.Column("ended_at", Instant),
    sa.Column("cancel_asked", sa.Boolean, nullable=False, server_default=sa.false()),
    sa.Column("why", sa.Text, nullable=False, server_default=""),  #: why it was cancelled or failed
    sa.Index(None, "state"),
)

#: What the criticisms of some units show of every effect, added up; it counts while each of its units' is the newest.
fleet_evidence = sa.Table(
    "fleet_evidence",
    metadata,
    id_column(),
    sa.Column("job_id", RowId, sa.ForeignKey("fleet_jobs.id"), nullable=False),
    sa.Column("type", sa.String(200), nullable=False),  #: model of the units
    sa.Column("model", sa.String(200), nullable=False),  #: error model of their versions
    sa.Column("units", sa.Integer, nullable=False),
    sa.Column("content", sa.LargeBinary, nullable=False),
    sa.Index(None, "type", "model"),
)

#: One row for each unit of a job, from its beginning. State: waiting, done, failed, skipped.
fleet_units = sa.Table(
    "fleet_units",
    metadata,
    sa.Column("job_id", RowId, sa.ForeignKey("fleet_jobs.id"), primary_key=True, autoincrement=False),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), primary_key=True),
    sa.Column("kind", sa.String(20), nullable=False),  #: that of the job
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("newest", sa.Boolean, nullable=False, server_default=sa.false()),  #: of the unit and kind, if done
    sa.Column("version", sa.Integer),  #: that was made, or judged
    sa.Column("question", sa.String(64), nullable=False, server_default=""),  #: digest of all that it depends on
    sa.Column("reason", sa.Text, nullable=False, server_default=""),  #: why it failed or was skipped
    sa.Column("at", Instant),
    sa.Column("processor_s", sa.Float),
    sa.Column("rms_dps", sa.Float),
    sa.Column("noise_floor_dps", sa.Float),
    sa.Column("verdict", sa.String(20)),
    sa.Column("named", sa.JSON(none_as_null=True)),  #: ids of the effects that a verdict is based on
    sa.Column("evidence_id", RowId, sa.ForeignKey("fleet_evidence.id")),  #: sums that hold what a criticism shows
    sa.Index(None, "serial", "kind", "newest"),
    sa.Index(None, "job_id", "state"),
    sa.Index(None, "evidence_id"),
)

#: Coefficients of the newest version of each unit that a fleet job has made.
fleet_coefficients = sa.Table(
    "fleet_coefficients",
    metadata,
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), primary_key=True),
    sa.Column("axis", sa.String(10), primary_key=True),
    sa.Column("name", sa.String(100), primary_key=True),
    sa.Column("value", sa.Float, nullable=False),
    sa.Column("u", sa.Float),
    sa.Column("unit", sa.String(40), nullable=False),
    sa.Column("model", sa.String(200), nullable=False),  #: error model
    sa.Column("version", sa.Integer, nullable=False),
    sa.Column("measured_at", Instant),
    sa.Column("bench", sa.String(200), nullable=False),  #: empty: the recording was imported
    sa.Index(None, "name", "axis", "measured_at"),
)
