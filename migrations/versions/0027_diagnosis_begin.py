"""The time before which a diagnosis begins no experiment."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0027"
down_revision = "0026"


def upgrade() -> None:
    """Add the column; every diagnosis was begun at once."""
    op.add_column("diagnoses", sa.Column("begins_at", sa.BigInteger(), nullable=True))


def downgrade() -> None:
    """Remove it, and what it holds."""
    op.drop_column("diagnoses", "begins_at")
