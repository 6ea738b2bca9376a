"""The head of the audit trail: how many rows there are, and the hash of the last."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Make the table, and the head of the trail as it stands."""
    op.create_table(
        "audit_head",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("length", sa.BigInteger(), nullable=False),
        sa.Column("hash", sa.String(length=64), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_audit_head")),
    )
    op.execute(
        "INSERT INTO audit_head (id, length, hash) SELECT 1, (SELECT COUNT(*) FROM audit), "
        "COALESCE((SELECT hash FROM audit ORDER BY id DESC LIMIT 1), "
        "'0000000000000000000000000000000000000000000000000000000000000000')"
    )


def downgrade() -> None:
    """Remove it."""
    op.drop_table("audit_head")
