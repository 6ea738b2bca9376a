"""The mark on a recording that is being imported, in short transactions: no reading method sees it before its end."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Add the columns; recordings of before are whole."""
    op.add_column("recordings", sa.Column("importing", sa.String(length=32), nullable=True))
    op.add_column("recordings", sa.Column("import_sign_at", sa.DateTime(timezone=True), nullable=True))
    op.create_index(op.f("ix_recordings_importing"), "recordings", ["importing"], unique=False)


def downgrade() -> None:
    """Remove them."""
    op.drop_index(op.f("ix_recordings_importing"), table_name="recordings")
    for column in ("import_sign_at", "importing"):
        op.drop_column("recordings", column)
