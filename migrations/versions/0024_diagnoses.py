"""Diagnoses and their rounds."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0024"
down_revision = "0023"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Make the tables; they are empty."""
    op.create_table(
        "diagnoses",
        sa.Column("id", _ROW_ID, autoincrement=True, nullable=False),
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("bench_name", sa.String(200), nullable=False),
        sa.Column("bench", sa.JSON(), nullable=False),
        sa.Column("hours", sa.Float(), nullable=False),
        sa.Column("recordings", sa.JSON(), nullable=False),
        sa.Column("by", sa.String(200), nullable=False),
        sa.Column("created_at", sa.BigInteger(), nullable=False),
        sa.Column("state", sa.String(30), nullable=False),
        sa.Column("outcome", sa.String(30), server_default="", nullable=False),
        sa.Column("why", sa.Text(), server_default="", nullable=False),
        sa.Column("ended_at", sa.BigInteger(), nullable=True),
        sa.ForeignKeyConstraint(["serial"], ["units.serial"], name=op.f("fk_diagnoses_serial_units")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_diagnoses")),
    )
    op.create_index(op.f("ix_diagnoses_serial_id"), "diagnoses", ["serial", "id"])
    op.create_index(op.f("ix_diagnoses_state"), "diagnoses", ["state"])
    op.create_table(
        "diagnosis_rounds",
        sa.Column("diagnosis_id", _ROW_ID, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=False),
        sa.Column("recordings", sa.JSON(), nullable=False),
        sa.Column("verdict", sa.String(30), nullable=False),
        sa.Column("named", sa.JSON(), nullable=False),
        sa.Column("suspects", sa.JSON(), nullable=False),
        sa.Column("spent_hours", sa.Float(), nullable=False),
        sa.Column("rms_dps", sa.Float(), nullable=True),
        sa.Column("heldout_rms_dps", sa.Float(), nullable=True),
        sa.Column("noise_floor_dps", sa.Float(), nullable=True),
        sa.Column("experiment", sa.JSON(), nullable=True),
        sa.Column("why", sa.Text(), nullable=False),
        sa.Column("confirmed_by", sa.String(200), server_default="", nullable=False),
        sa.Column("since", sa.BigInteger(), nullable=False),
        sa.Column("campaign_id", _ROW_ID, nullable=True),
        sa.Column("recording_id", _ROW_ID, nullable=True),
        sa.Column("took_hours", sa.Float(), nullable=True),
        sa.Column("came", sa.String(20), server_default="", nullable=False),
        sa.Column("came_text", sa.Text(), server_default="", nullable=False),
        sa.ForeignKeyConstraint(
            ["diagnosis_id"], ["diagnoses.id"], name=op.f("fk_diagnosis_rounds_diagnosis_id_diagnoses")
        ),
        sa.ForeignKeyConstraint(
            ["campaign_id"], ["campaigns.id"], name=op.f("fk_diagnosis_rounds_campaign_id_campaigns")
        ),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name=op.f("fk_diagnosis_rounds_recording_id_recordings")
        ),
        sa.PrimaryKeyConstraint("diagnosis_id", "number", name=op.f("pk_diagnosis_rounds")),
    )


def downgrade() -> None:
    """Remove them, with every diagnosis; the campaigns that it ran stay."""
    op.drop_table("diagnosis_rounds")
    op.drop_index(op.f("ix_diagnoses_state"), table_name="diagnoses")
    op.drop_index(op.f("ix_diagnoses_serial_id"), table_name="diagnoses")
    op.drop_table("diagnoses")
