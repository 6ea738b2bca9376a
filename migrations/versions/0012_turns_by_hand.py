"""By which angle the units were turned in a data set that a campaign took by hand."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"


def upgrade() -> None:
    """Add the angle and its standard uncertainty; no data set of before was turned by hand."""
    op.add_column("data_sets", sa.Column("turn_deg", sa.Float(), nullable=True))
    op.add_column("data_sets", sa.Column("turn_u_deg", sa.Float(), nullable=True))


def downgrade() -> None:
    """Remove them; turns by hand become data sets at rest."""
    op.drop_column("data_sets", "turn_u_deg")
    op.drop_column("data_sets", "turn_deg")
