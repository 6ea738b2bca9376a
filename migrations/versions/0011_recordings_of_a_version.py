"""All recordings that a version was fitted to, where there are several."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"


def _row_id() -> sa.types.TypeEngine[int]:
    return sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Make the table; each version of before has the recording that it was fitted to."""
    op.create_table(
        "calibration_recordings",
        sa.Column("calibration_id", _row_id(), nullable=False),
        sa.Column("recording_id", _row_id(), nullable=False),
        sa.ForeignKeyConstraint(
            ["calibration_id"],
            ["calibrations.id"],
            name=op.f("fk_calibration_recordings_calibration_id_calibrations"),
        ),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name=op.f("fk_calibration_recordings_recording_id_recordings")
        ),
        sa.PrimaryKeyConstraint("calibration_id", "recording_id", name=op.f("pk_calibration_recordings")),
    )
    op.execute(
        "INSERT INTO calibration_recordings (calibration_id, recording_id) "
        "SELECT id, recording_id FROM calibrations WHERE recording_id IS NOT NULL"
    )


def downgrade() -> None:
    """Remove it; a version keeps its newest recording."""
    op.drop_table("calibration_recordings")
