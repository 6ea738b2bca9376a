"""Data sets that are measured to verify a calibration, and are never fitted."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0018"
down_revision = "0017"


def upgrade() -> None:
    """Add the mark; no data set of before has it."""
    mark: sa.Column[bool] = sa.Column("verification", sa.Boolean(), server_default=sa.false(), nullable=False)
    op.add_column("data_sets", mark)


def downgrade() -> None:
    """Remove it; what was measured to verify is then data like any other."""
    op.drop_column("data_sets", "verification")
