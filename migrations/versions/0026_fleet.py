"""Fleet jobs, what came of each of their units, and the coefficients of the newest fits."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0026"
down_revision = "0025"


def upgrade() -> None:
    """Add the tables; there was no fleet job yet."""
    op.create_table(
        "fleet_jobs",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), autoincrement=True, nullable=False),
        sa.Column("kind", sa.String(20), nullable=False),
        sa.Column("request", sa.JSON(), nullable=False),
        sa.Column("engine", sa.String(300), nullable=False),
        sa.Column("by", sa.String(200), nullable=False),
        sa.Column("created_at", sa.BigInteger(), nullable=False),
        sa.Column("units", sa.Integer(), nullable=False),
        sa.Column("state", sa.String(20), nullable=False),
        sa.Column("runner", sa.String(200), server_default="", nullable=False),
        sa.Column("seen_at", sa.BigInteger(), nullable=True),
        sa.Column("started_at", sa.BigInteger(), nullable=True),
        sa.Column("ended_at", sa.BigInteger(), nullable=True),
        sa.Column("cancel_asked", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.Column("why", sa.Text(), server_default="", nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_fleet_jobs")),
    )
    op.create_index(op.f("ix_fleet_jobs_state"), "fleet_jobs", ["state"])

    op.create_table(
        "fleet_coefficients",
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("axis", sa.String(10), nullable=False),
        sa.Column("name", sa.String(100), nullable=False),
        sa.Column("value", sa.Float(), nullable=False),
        sa.Column("u", sa.Float(), nullable=True),
        sa.Column("unit", sa.String(40), nullable=False),
        sa.Column("model", sa.String(200), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("measured_at", sa.BigInteger(), nullable=True),
        sa.Column("bench", sa.String(200), nullable=False),
        sa.ForeignKeyConstraint(["serial"], ["units.serial"], name=op.f("fk_fleet_coefficients_serial_units")),
        sa.PrimaryKeyConstraint("serial", "axis", "name", name=op.f("pk_fleet_coefficients")),
    )
    op.create_index(
        op.f("ix_fleet_coefficients_name_axis_measured_at"), "fleet_coefficients", ["name", "axis", "measured_at"]
    )

    op.create_table(
        "fleet_evidence",
        sa.Column("id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), autoincrement=True, nullable=False),
        sa.Column("job_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=False),
        sa.Column("type", sa.String(200), nullable=False),
        sa.Column("model", sa.String(200), nullable=False),
        sa.Column("units", sa.Integer(), nullable=False),
        sa.Column("content", sa.LargeBinary(), nullable=False),
        sa.ForeignKeyConstraint(["job_id"], ["fleet_jobs.id"], name=op.f("fk_fleet_evidence_job_id_fleet_jobs")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_fleet_evidence")),
    )
    op.create_index(op.f("ix_fleet_evidence_type_model"), "fleet_evidence", ["type", "model"])

    op.create_table(
        "fleet_units",
        sa.Column("job_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), autoincrement=False, nullable=False),
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("kind", sa.String(20), nullable=False),
        sa.Column("state", sa.String(20), nullable=False),
        sa.Column("newest", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=True),
        sa.Column("question", sa.String(64), server_default="", nullable=False),
        sa.Column("reason", sa.Text(), server_default="", nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=True),
        sa.Column("processor_s", sa.Float(), nullable=True),
        sa.Column("rms_dps", sa.Float(), nullable=True),
        sa.Column("noise_floor_dps", sa.Float(), nullable=True),
        sa.Column("verdict", sa.String(20), nullable=True),
        sa.Column("named", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("evidence_id", sa.BigInteger().with_variant(sa.Integer(), "sqlite"), nullable=True),
        sa.ForeignKeyConstraint(["job_id"], ["fleet_jobs.id"], name=op.f("fk_fleet_units_job_id_fleet_jobs")),
        sa.ForeignKeyConstraint(
            ["evidence_id"], ["fleet_evidence.id"], name=op.f("fk_fleet_units_evidence_id_fleet_evidence")
        ),
        sa.ForeignKeyConstraint(["serial"], ["units.serial"], name=op.f("fk_fleet_units_serial_units")),
        sa.PrimaryKeyConstraint("job_id", "serial", name=op.f("pk_fleet_units")),
    )
    op.create_index(op.f("ix_fleet_units_job_id_state"), "fleet_units", ["job_id", "state"])
    op.create_index(op.f("ix_fleet_units_evidence_id"), "fleet_units", ["evidence_id"])
    op.create_index(op.f("ix_fleet_units_serial_kind_newest"), "fleet_units", ["serial", "kind", "newest"])


def downgrade() -> None:
    """Remove them, and what they hold."""
    for table in ("fleet_units", "fleet_evidence", "fleet_coefficients", "fleet_jobs"):
        op.drop_table(table)
