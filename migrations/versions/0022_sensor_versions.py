"""Versions of a unit's accelerometer and magnetometer."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Make the table; it is empty: until now such results were printed and not kept."""
    op.create_table(
        "sensor_versions",
        sa.Column("id", _ROW_ID, autoincrement=True, nullable=False),
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("sensor", sa.String(20), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("verdict", sa.String(20), nullable=False),
        sa.Column("data", sa.JSON(), nullable=False),
        sa.Column("document", sa.LargeBinary(), nullable=False),
        sa.Column("hash", sa.String(64), nullable=False),
        sa.Column("by", sa.String(200), nullable=False),
        sa.Column("by_key", sa.String(100), nullable=True),
        sa.Column("at", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(["serial"], ["units.serial"], name=op.f("fk_sensor_versions_serial_units")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_sensor_versions")),
        sa.UniqueConstraint("serial", "sensor", "version", name=op.f("uq_sensor_versions_serial_sensor_version")),
    )


def downgrade() -> None:
    """Remove it, with every version."""
    op.drop_table("sensor_versions")
