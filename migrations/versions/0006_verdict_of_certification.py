"""What was known of a version when it was certified: verdict, recording, when, override, and what stood against it."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"


def upgrade() -> None:
    """Add the columns; acts of before have null in them."""
    row_id = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
    op.add_column("certifications", sa.Column("verdict", sa.String(length=20), nullable=True))
    op.add_column("certifications", sa.Column("verdict_recording", row_id, nullable=True))
    op.add_column("certifications", sa.Column("verdict_at", sa.BigInteger(), nullable=True))
    op.add_column("certifications", sa.Column("override", sa.Boolean(), nullable=True))
    op.add_column("certifications", sa.Column("assessment", sa.JSON(), nullable=True))


def downgrade() -> None:
    """Remove them."""
    for column in ("assessment", "override", "verdict_at", "verdict_recording", "verdict"):
        op.drop_column("certifications", column)
