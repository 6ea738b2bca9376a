"""The batch and the supplier of a unit."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0025"
down_revision = "0024"


def upgrade() -> None:
    """Add the columns; no unit has a batch yet."""
    with op.batch_alter_table("units") as units:
        units.add_column(sa.Column("batch", sa.String(100), server_default="", nullable=False))
        units.add_column(sa.Column("supplier", sa.String(200), server_default="", nullable=False))
        units.create_index(op.f("ix_units_batch"), ["batch"])


def downgrade() -> None:
    """Remove them, and what they hold."""
    with op.batch_alter_table("units") as units:
        units.drop_index(op.f("ix_units_batch"))
        units.drop_column("supplier")
        units.drop_column("batch")
