"""Runs that time the step clock of a table."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0023"
down_revision = "0022"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Make the table; it is empty: until now only the result of two runs was kept, in the step that made them."""
    op.create_table(
        "timed_runs",
        sa.Column("id", _ROW_ID, autoincrement=True, nullable=False),
        sa.Column("campaign_id", _ROW_ID, nullable=False),
        sa.Column("session", sa.Integer(), nullable=False),
        sa.Column("block", sa.Integer(), nullable=False),
        sa.Column("t_s", sa.Float(), nullable=False),
        sa.Column("nominal_s", sa.Float(), nullable=False),
        sa.Column("duration_s", sa.Float(), nullable=False),
        sa.Column("step_hz", sa.Float(), nullable=False),
        sa.Column("used", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["campaign_id"], ["campaigns.id"], name=op.f("fk_timed_runs_campaign_id_campaigns")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_timed_runs")),
    )
    op.create_index(op.f("ix_timed_runs_campaign_id_id"), "timed_runs", ["campaign_id", "id"])


def downgrade() -> None:
    """Remove it, with every run."""
    op.drop_index(op.f("ix_timed_runs_campaign_id_id"), table_name="timed_runs")
    op.drop_table("timed_runs")
