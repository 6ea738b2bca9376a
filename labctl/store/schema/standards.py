"""The tables of the register of reference standards, and of the gyros that serve as check standards.

Rows are only ever added: what is corrected or withdrawn has a later row that says so.
"""

from __future__ import annotations

import sqlalchemy as sa

from labctl.store.schema.types import Instant, RowId, id_column, metadata


def _standard_column() -> sa.Column[int]:
    return sa.Column("standard_id", RowId, sa.ForeignKey("standards.id"), nullable=False)


standards = sa.Table(
    "standards",
    metadata,
    id_column(),
    sa.Column("label", sa.String(100), nullable=False, unique=True),  #: as the bench files name it
    sa.Column("serial", sa.String(100), nullable=False),
    sa.Column("quantity", sa.String(20), nullable=False),
    sa.Column("unit", sa.String(10), nullable=False),
    sa.Column("description", sa.Text, nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("at", Instant, nullable=False),
)

#: Days as YYYY-MM-DD. A row with a reason replaces one of its number, which was typed wrong; `reason` says how.
standard_certificates = sa.Table(
    "standard_certificates",
    metadata,
    id_column(),
    _standard_column(),
    sa.Column("number", sa.String(100), nullable=False),
    sa.Column("laboratory", sa.String(300), nullable=False),
    sa.Column("calibrated", sa.String(10), nullable=False),
    sa.Column("due", sa.String(10)),
    sa.Column("adjusted", sa.Boolean, nullable=False),  #: the standard was adjusted or repaired before
    sa.Column("traceability", sa.Text, nullable=False),
    sa.Column("points", sa.JSON, nullable=False),  #: list of nominal, value, u, k
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Index(None, "standard_id", "id"),
)

standard_checks = sa.Table(
    "standard_checks",
    metadata,
    id_column(),
    _standard_column(),
    sa.Column("checked_at", Instant, nullable=False),
    sa.Column("nominal", sa.Float),
    sa.Column("value", sa.Float, nullable=False),
    sa.Column("u", sa.Float, nullable=False),
    sa.Column("note", sa.Text, nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Index(None, "standard_id", "checked_at"),
)

#: Act: bad, with days from and until (absent: still), or withdraw, with the number of the finding.
standard_findings = sa.Table(
    "standard_findings",
    metadata,
    id_column(),
    _standard_column(),
    sa.Column("act", sa.String(10), nullable=False),
    sa.Column("finding", RowId, sa.ForeignKey("standard_findings.id")),
    sa.Column("bad_from", sa.String(10)),
    sa.Column("bad_until", sa.String(10)),
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Index(None, "standard_id", "id"),
)

#: Act: mark, with the temperature of its bias and the first day of its chart, or unmark.
check_gyros = sa.Table(
    "check_gyros",
    metadata,
    id_column(),
    sa.Column("serial", sa.String(200), sa.ForeignKey("units.serial"), nullable=False),
    sa.Column("act", sa.String(10), nullable=False),
    sa.Column("temperature_c", sa.Float),
    sa.Column("chart_from", sa.String(10)),
    sa.Column("reason", sa.Text, nullable=False),
    sa.Column("by", sa.String(200), nullable=False),
    sa.Column("at", Instant, nullable=False),
    sa.Index(None, "serial", "id"),
)
