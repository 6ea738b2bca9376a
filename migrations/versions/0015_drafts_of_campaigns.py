"""The draft calibration that a campaign ends in, and what a scheduled start has beside its recipe."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Add the table; campaigns of before end in no draft, and entries of before hide no effect."""
    op.create_table(
        "drafts",
        sa.Column("recording_id", _ROW_ID, autoincrement=False, nullable=False),
        sa.Column("campaign_id", _ROW_ID, nullable=False),
        sa.Column("serial", sa.String(length=200), nullable=False),
        sa.Column("state", sa.String(length=20), nullable=False),
        sa.Column("version", sa.Integer(), nullable=True),
        sa.Column("at", sa.BigInteger(), nullable=True),
        sa.Column("reason", sa.Text(), server_default="", nullable=False),
        sa.Column("report", sa.JSON(none_as_null=True), nullable=True),
        sa.ForeignKeyConstraint(["recording_id"], ["recordings.id"], name="fk_drafts_recording_id_recordings"),
        sa.ForeignKeyConstraint(["campaign_id"], ["campaigns.id"], name="fk_drafts_campaign_id_campaigns"),
        sa.PrimaryKeyConstraint("recording_id", name="pk_drafts"),
    )
    op.create_index("ix_drafts_campaign_id", "drafts", ["campaign_id"])
    op.create_index("ix_drafts_serial_recording_id", "drafts", ["serial", "recording_id"])
    op.create_index("ix_drafts_state", "drafts", ["state"])
    op.add_column("scheduled_starts", sa.Column("hide", sa.JSON(none_as_null=True), nullable=True))
    op.add_column("scheduled_starts", sa.Column("fit", sa.Boolean(), server_default=sa.true(), nullable=False))


def downgrade() -> None:
    """Remove them; the versions that drafts made stay."""
    for column in ("fit", "hide"):
        op.drop_column("scheduled_starts", column)
    op.drop_table("drafts")
