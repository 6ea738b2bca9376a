"""Versions of accelerometers and magnetometers."""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, id_column, metadata

sensor_versions = sa.Table(
    "sensor_versions",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("sensor", sa.String(20), nullable=False),  #: accelerometer or magnetometer
    sa.Column("version", sa.Integer, nullable=False),  #: from 1, per serial number and sensor
    sa.Column("verdict", sa.String(20), nullable=False),
    sa.Column("data", sa.JSON, nullable=False),  #: how the files were read, and the name and SHA-256 of each
    sa.Column("document", sa.LargeBinary, nullable=False),  #: canonical JSON of the result with its covariance
    sa.Column("hash", sa.String(64), nullable=False),  #: SHA-256 of the document
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("by_key", sa.String(100)),  #: API key of the one who acted; absent: the name is as typed
    sa.Column("at", Instant, nullable=False),
    sa.UniqueConstraint("serial", "sensor", "version"),
)
