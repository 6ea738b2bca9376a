"""Units: gyros by serial number."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sqlalchemy as sa

from labctl.natural_order import natural_key
from labctl.store.schema.types import ByBytes, Instant, metadata

if TYPE_CHECKING:
    from sqlalchemy.engine.default import DefaultExecutionContext


def _key_of_serial(context: DefaultExecutionContext) -> str:
    """Return the sort key of the unit that is being added."""
    parameters = context.current_parameters
    assert parameters is not None, "the row of a unit is added with its serial number"
    return natural_key(str(parameters["serial"]))


units = sa.Table(
    "units",
    metadata,
    sa.Column("serial", sa.String(200), primary_key=True),
    sa.Column("model", sa.String(200), nullable=False),
    sa.Column("technology", sa.String(20)),
    sa.Column("first_seen_at", Instant, nullable=False),
    sa.Column("batch", sa.String(100), nullable=False, default="", server_default=""),
    sa.Column("supplier", sa.String(200), nullable=False, default="", server_default=""),
    #: `natural_key` of the serial number, by which units are listed; compared by its bytes in every database
    sa.Column("serial_key", ByBytes, nullable=False, default=_key_of_serial, server_default=""),
    sa.Index(None, "batch"),
    sa.Index(None, "serial_key"),
)
