"""The register of reference standards, gyros that serve as check standards, and the environment of the room."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0020"
down_revision = "0019"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def _id() -> sa.Column[int]:
    return sa.Column("id", _ROW_ID, autoincrement=True, nullable=False)


def _standard() -> sa.Column[int]:
    return sa.Column("standard_id", _ROW_ID, nullable=False)


def _who() -> list[sa.Column[str] | sa.Column[int]]:
    return [
        sa.Column("by", sa.String(200), nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=False),
    ]


def _of_standard(table: str) -> sa.ForeignKeyConstraint:
    name = op.f(f"fk_{table}_standard_id_standards")
    return sa.ForeignKeyConstraint(["standard_id"], ["standards.id"], name=name)


def upgrade() -> None:
    """Make the tables; they are empty: what a bench file says of its standards stays where it is."""
    op.create_table(
        "standards",
        _id(),
        sa.Column("label", sa.String(100), nullable=False),
        sa.Column("serial", sa.String(100), nullable=False),
        sa.Column("quantity", sa.String(20), nullable=False),
        sa.Column("unit", sa.String(10), nullable=False),
        sa.Column("description", sa.Text(), nullable=False),
        *_who(),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_standards")),
        sa.UniqueConstraint("label", name=op.f("uq_standards_label")),
    )
    op.create_table(
        "standard_certificates",
        _id(),
        _standard(),
        sa.Column("number", sa.String(100), nullable=False),
        sa.Column("laboratory", sa.String(300), nullable=False),
        sa.Column("calibrated", sa.String(10), nullable=False),
        sa.Column("due", sa.String(10), nullable=True),
        sa.Column("adjusted", sa.Boolean(), nullable=False),
        sa.Column("traceability", sa.Text(), nullable=False),
        sa.Column("points", sa.JSON(), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        *_who(),
        _of_standard("standard_certificates"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_standard_certificates")),
    )
    op.create_index(op.f("ix_standard_certificates_standard_id_id"), "standard_certificates", ["standard_id", "id"])
    op.create_table(
        "standard_checks",
        _id(),
        _standard(),
        sa.Column("checked_at", sa.BigInteger(), nullable=False),
        sa.Column("nominal", sa.Float(), nullable=True),
        sa.Column("value", sa.Float(), nullable=False),
        sa.Column("u", sa.Float(), nullable=False),
        sa.Column("note", sa.Text(), nullable=False),
        *_who(),
        _of_standard("standard_checks"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_standard_checks")),
    )
    op.create_index(op.f("ix_standard_checks_standard_id_checked_at"), "standard_checks", ["standard_id", "checked_at"])
    op.create_table(
        "standard_findings",
        _id(),
        _standard(),
        sa.Column("act", sa.String(10), nullable=False),
        sa.Column("finding", _ROW_ID, nullable=True),
        sa.Column("bad_from", sa.String(10), nullable=True),
        sa.Column("bad_until", sa.String(10), nullable=True),
        sa.Column("reason", sa.Text(), nullable=False),
        *_who(),
        sa.ForeignKeyConstraint(
            ["finding"], ["standard_findings.id"], name=op.f("fk_standard_findings_finding_standard_findings")
        ),
        _of_standard("standard_findings"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_standard_findings")),
    )
    op.create_index(op.f("ix_standard_findings_standard_id_id"), "standard_findings", ["standard_id", "id"])
    op.create_table(
        "check_gyros",
        _id(),
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("act", sa.String(10), nullable=False),
        sa.Column("temperature_c", sa.Float(), nullable=True),
        sa.Column("chart_from", sa.String(10), nullable=True),
        sa.Column("reason", sa.Text(), nullable=False),
        *_who(),
        sa.ForeignKeyConstraint(["serial"], ["units.serial"], name=op.f("fk_check_gyros_serial_units")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_check_gyros")),
    )
    op.create_index(op.f("ix_check_gyros_serial_id"), "check_gyros", ["serial", "id"])
    op.create_table(
        "room_environment",
        _id(),
        sa.Column("measured_at", sa.BigInteger(), nullable=False),
        sa.Column("bench_name", sa.String(200), nullable=False),
        sa.Column("quantity", sa.String(20), nullable=False),
        sa.Column("unit", sa.String(10), nullable=False),
        sa.Column("value", sa.Float(), nullable=False),
        sa.Column("source", sa.String(200), nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_room_environment")),
    )
    op.create_index(op.f("ix_room_environment_measured_at"), "room_environment", ["measured_at"])


def downgrade() -> None:
    """Remove them, with every certificate, check and finding."""
    for table in (
        "room_environment", "check_gyros", "standard_findings", "standard_checks", "standard_certificates", "standards",
    ):  # fmt: skip
        op.drop_table(table)
