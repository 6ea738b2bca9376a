"""The batch and the supplier of a unit."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"


def upgrade() -> None:
    """Add the columns; no unit has a batch yet."""
    op.add_column("units", sa.Column("batch", sa.String(100), server_default="", nullable=False))
    op.add_column("units", sa.Column("supplier", sa.String(200), server_default="", nullable=False))
    op.create_index(op.f("ix_units_batch"), "units", ["batch"])


def downgrade() -> None:
    """Remove them, and what they hold."""
    op.drop_index(op.f("ix_units_batch"), table_name="units")
    op.drop_column("units", "supplier")
    op.drop_column("units", "batch")
