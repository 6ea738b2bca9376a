"""Taking up a campaign: the plan's number of a data set, sessions, who dropped out, and benches not confirmed safe."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Add the columns."""
    op.add_column("campaigns", sa.Column("added_runs", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("campaigns", sa.Column("powered_on_s", sa.Float(), nullable=True))
    op.add_column("campaigns", sa.Column("boot_id", sa.String(length=64), nullable=True))
    op.add_column("data_sets", sa.Column("planned", sa.Integer(), nullable=True))
    op.add_column("recordings", sa.Column("dropped", sa.Text(), nullable=True))
    op.add_column("benches", sa.Column("unconfirmed", sa.Text(), nullable=False, server_default=""))
    op.add_column("benches", sa.Column("unconfirmed_at", sa.BigInteger(), nullable=True))


def downgrade() -> None:
    """Remove them."""
    columns = (
        ("benches", "unconfirmed_at"),
        ("benches", "unconfirmed"),
        ("recordings", "dropped"),
        ("data_sets", "planned"),
        ("campaigns", "boot_id"),
        ("campaigns", "powered_on_s"),
        ("campaigns", "added_runs"),
    )
    for table, column in columns:
        op.drop_column(table, column)
