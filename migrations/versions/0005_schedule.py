"""Scheduled starts, what became of them, and the leases on benches."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"


def _row_id() -> sa.types.TypeEngine[int]:
    return sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Make the tables."""
    op.create_table(
        "scheduled_starts",
        sa.Column("id", _row_id(), autoincrement=True, nullable=False),
        sa.Column("bench_name", sa.String(length=200), nullable=False),
        sa.Column("recipe_name", sa.String(length=200), nullable=False),
        sa.Column("recipe", sa.Text(), nullable=False),
        sa.Column("clip", sa.Boolean(), nullable=False),
        sa.Column("priority", sa.Integer(), nullable=False),
        sa.Column("cron", sa.String(length=200), nullable=True),
        sa.Column("time_zone", sa.String(length=100), nullable=False),
        sa.Column("late_limit_s", sa.Float(), nullable=True),
        sa.Column("due_at", sa.BigInteger(), nullable=False),
        sa.Column("state", sa.String(length=20), nullable=False),
        sa.Column("created_at", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_scheduled_starts")),
    )
    op.create_index(
        op.f("ix_scheduled_starts_bench_name_state_due_at"),
        "scheduled_starts",
        ["bench_name", "state", "due_at"],
        unique=False,
    )
    op.create_table(
        "start_events",
        sa.Column("id", _row_id(), autoincrement=True, nullable=False),
        sa.Column("start_id", _row_id(), nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=False),
        sa.Column("due_at", sa.BigInteger(), nullable=False),
        sa.Column("outcome", sa.String(length=20), nullable=False),
        sa.Column("message", sa.Text(), nullable=False),
        sa.Column("campaign_id", _row_id(), nullable=True),
        sa.Column("after_campaign", _row_id(), nullable=False),
        sa.ForeignKeyConstraint(
            ["start_id"], ["scheduled_starts.id"], name=op.f("fk_start_events_start_id_scheduled_starts")
        ),
        sa.ForeignKeyConstraint(["campaign_id"], ["campaigns.id"], name=op.f("fk_start_events_campaign_id_campaigns")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_start_events")),
    )
    op.create_index(op.f("ix_start_events_start_id_id"), "start_events", ["start_id", "id"], unique=False)
    op.create_table(
        "leases",
        sa.Column("bench_name", sa.String(length=200), nullable=False),
        sa.Column("owner", sa.String(length=32), nullable=False),
        sa.Column("host", sa.String(length=200), nullable=False),
        sa.Column("machine", sa.String(length=200), nullable=False),
        sa.Column("pid", sa.BigInteger(), nullable=False),
        sa.Column("since", sa.BigInteger(), nullable=False),
        sa.Column("beat", sa.BigInteger(), nullable=False),
        sa.Column("beat_at", sa.BigInteger(), nullable=False),
        sa.Column("expires_at", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("bench_name", name=op.f("pk_leases")),
    )


def downgrade() -> None:
    """Remove them."""
    op.drop_table("leases")
    op.drop_index(op.f("ix_start_events_start_id_id"), table_name="start_events")
    op.drop_table("start_events")
    op.drop_index(op.f("ix_scheduled_starts_bench_name_state_due_at"), table_name="scheduled_starts")
    op.drop_table("scheduled_starts")
