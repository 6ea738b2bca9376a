"""What long lists need: a sort key of serial numbers, for the natural order, and indexes."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import context, op

revision = "0028"
down_revision = "0027"

#: Units whose keys are written by one statement.
_AT_ONCE = 5000


def upgrade() -> None:
    """Add the column with its index, the key of each unit, and indexes of acts by subject, recordings by campaign."""
    by_bytes = sa.Text().with_variant(sa.Text(collation="C"), "postgresql")
    op.add_column("units", sa.Column("serial_key", by_bytes, server_default="", nullable=False))
    if not context.is_offline_mode():
        _write_keys(op.get_bind())
    op.create_index(op.f("ix_units_serial_key"), "units", ["serial_key"])
    op.create_index(op.f("ix_audit_action_subject"), "audit", ["action", "subject"])
    op.create_index(op.f("ix_recordings_campaign_id"), "recordings", ["campaign_id"])


def downgrade() -> None:
    """Remove them; the keys follow from the serial numbers."""
    op.drop_index(op.f("ix_recordings_campaign_id"), table_name="recordings")
    op.drop_index(op.f("ix_audit_action_subject"), table_name="audit")
    op.drop_index(op.f("ix_units_serial_key"), table_name="units")
    op.drop_column("units", "serial_key")


def _write_keys(connection: sa.Connection) -> None:
    from labctl.natural_order import natural_key  # noqa: PLC0415  only where there may be units

    units = sa.table("units", sa.column("serial", sa.String()), sa.column("serial_key", sa.Text()))
    serials = list(connection.scalars(sa.select(units.c.serial)))
    write = sa.update(units).where(units.c.serial == sa.bindparam("unit")).values(serial_key=sa.bindparam("key"))
    for first in range(0, len(serials), _AT_ONCE):
        some = serials[first : first + _AT_ONCE]
        connection.execute(write, [{"unit": serial, "key": natural_key(serial)} for serial in some])
