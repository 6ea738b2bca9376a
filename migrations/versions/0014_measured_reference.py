"""What the encoder of a servo table said during a data set."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0012"


def upgrade() -> None:
    """Add its angles and the rate that follows; no data set of before has any."""
    op.add_column("data_sets", sa.Column("encoder", sa.JSON(none_as_null=True), nullable=True))


def downgrade() -> None:
    """Remove them; the reference of each data set stays."""
    op.drop_column("data_sets", "encoder")
