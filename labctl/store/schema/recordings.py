"""The tables of recordings: data sets, their means, blocks of readings and the environment."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata, recording_column

recordings = sa.Table(
    "recordings",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id")),
    sa.Column("gyro", sa.String(100)),
    sa.Column("kind", sa.String(20), nullable=False),
    sa.Column("info", sa.JSON, nullable=False),
    sa.Column("channels", sa.JSON, nullable=False),
    sa.Column("created_at", Instant, nullable=False),
    sa.Column("dropped", sa.Text),  #: why the unit was excluded from the campaign; absent while it takes part
    sa.Column("importing", sa.String(32)),  #: token of the import under way; absent once all of it is in
    sa.Column("import_sign_at", sa.DateTime(timezone=True)),  #: its last sign, by the clock of the database server
    sa.Index(None, "serial", "id"),
    sa.Index(None, "importing"),
    sa.Index(None, "campaign_id"),
)

data_sets = sa.Table(
    "data_sets",
    metadata,
    sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("state", sa.String(20), nullable=False),
    sa.Column("reason", sa.Text, nullable=False, default=""),
    sa.Column("position", sa.String(10).with_variant(sa.String(2), "sqlite"), nullable=False),  # SQLite keeps no width
    sa.Column("run", sa.Integer, nullable=False),
    sa.Column("mounting", sa.Integer, nullable=False),
    sa.Column("table_rate_dps", sa.Float, nullable=False),
    sa.Column("asked_dps", sa.Float),
    sa.Column("table_angle_deg", sa.Float),
    sa.Column("chamber_setpoint_c", sa.Float),
    sa.Column("gate_from_s", sa.Float),
    sa.Column("gate_until_s", sa.Float),
    sa.Column("power_on_s", sa.Float),
    sa.Column("n", sa.Integer, nullable=False, default=0),
    sa.Column("lost", sa.Integer, nullable=False, default=0),
    sa.Column("damaged", sa.Integer, nullable=False, default=0),
    sa.Column("turn_deg", sa.Float),  #: of a turn by hand, 0 of a rest beside it; absent for a rate of a table
    sa.Column("turn_u_deg", sa.Float),
    #: angles by the table's encoder and the rate that follows, as EncoderAngles; absent for a table without one
    sa.Column("encoder", sa.JSON(none_as_null=True)),
    #: whether it was measured to verify a calibration, and is never fitted
    sa.Column("verification", sa.Boolean, nullable=False, default=False, server_default=sa.false()),
    sa.Column("planned", sa.Integer),  #: its number in the plan: one that is redone has the same again
)

data_set_means = sa.Table(
    "data_set_means",
    metadata,
    sa.Column("recording_id", RowId, primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("channel", sa.String(60), primary_key=True),
    sa.Column("mean", sa.Float),
    sa.Column("std", sa.Float),
    sa.Column("white_std", sa.Float),
    sa.Column("n", sa.Integer, nullable=False),
    sa.ForeignKeyConstraint(["recording_id", "number"], ["data_sets.recording_id", "data_sets.number"]),
)

#: Number 0 holds a whole table of points or coefficients; the others are readings of a data set.
sample_blocks = sa.Table(
    "sample_blocks",
    metadata,
    id_column(),
    recording_column(),
    sa.Column("number", sa.Integer, nullable=False),
    sa.Column("seq", sa.Integer, nullable=False),
    sa.Column("n", sa.Integer, nullable=False),
    sa.Column("codec", sa.Integer, nullable=False),
    sa.Column("crc32", sa.BigInteger, nullable=False),
    sa.Column("data", sa.LargeBinary, nullable=False),
    sa.UniqueConstraint("recording_id", "number", "seq"),
)

environment = sa.Table(
    "environment",
    metadata,
    id_column(),
    recording_column(),
    sa.Column("t_s", sa.Float, nullable=False),
    sa.Column("run", sa.Integer, nullable=False),
    sa.Column("temperature_c", sa.Float, nullable=False),
    sa.Column("chamber_c", sa.Float),
    sa.Column("chamber_setpoint_c", sa.Float),
    sa.Index(None, "recording_id", "id"),
)
