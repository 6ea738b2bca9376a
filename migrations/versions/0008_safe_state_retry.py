"""The safe state of an unconfirmed bench is tried again: how often, when last, and when it was confirmed."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"


def upgrade() -> None:
    """Add the columns; a bench that is unconfirmed was not tried again before."""
    op.add_column("benches", sa.Column("attempts", sa.Integer(), nullable=False, server_default="0"))
    op.add_column("benches", sa.Column("attempted_at", sa.BigInteger(), nullable=True))
    op.add_column("benches", sa.Column("confirmed_at", sa.BigInteger(), nullable=True))


def downgrade() -> None:
    """Remove them."""
    for column in ("confirmed_at", "attempted_at", "attempts"):
        op.drop_column("benches", column)
