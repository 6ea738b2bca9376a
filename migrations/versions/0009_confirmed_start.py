"""Who confirmed that a bench will be clear when a scheduled campaign begins, and when its plan needs a person."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"


def upgrade() -> None:
    """Add the columns; entries of before have null in them."""
    op.add_column("scheduled_starts", sa.Column("confirmed_by", sa.String(length=200), nullable=True))
    op.add_column("scheduled_starts", sa.Column("visits_s", sa.JSON(), nullable=True))


def downgrade() -> None:
    """Remove them."""
    for column in ("visits_s", "confirmed_by"):
        op.drop_column("scheduled_starts", column)
