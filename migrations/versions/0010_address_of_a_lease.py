"""Where the service that drives a bench is reached, for commands of other processes on the same database."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"


def upgrade() -> None:
    """Add the columns; a lease of before has null in them."""
    op.add_column("leases", sa.Column("url", sa.Text(), nullable=True))
    op.add_column("leases", sa.Column("calls", sa.Text(), nullable=True))


def downgrade() -> None:
    """Remove them."""
    for column in ("calls", "url"):
        op.drop_column("leases", column)
