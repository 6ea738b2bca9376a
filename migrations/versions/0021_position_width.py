"""Positions that also name by how much the unit and its fixture are turned, such as x@180."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"


def upgrade() -> None:
    """Make room for them. SQLite keeps no width, so there is nothing to rewrite."""
    if op.get_bind().dialect.name != "sqlite":
        _set_width(2, 10)


def downgrade() -> None:
    """Take it away; refused by the database where such positions are stored."""
    if op.get_bind().dialect.name != "sqlite":
        _set_width(10, 2)


def _set_width(before: int, after: int) -> None:
    existing = sa.String(before)
    op.alter_column("data_sets", "position", type_=sa.String(after), existing_type=existing, existing_nullable=False)
