"""The life of a certificate: withdrawals, keys of those who act, releases by a second person, fetches of versions."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import context, op

revision = "0019"
down_revision = "0018"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
#: Columns that tables get; null in every row of before.
_ADDED = (
    ("certificates", "by_key", sa.String(100)),
    ("certifications", "by_key", sa.String(100)),
    ("certifications", "request_id", _ROW_ID),
    ("certifications", "released_by", sa.String(200)),
    ("certifications", "released_key", sa.String(100)),
    ("certifications", "release_reason", sa.Text()),
)


def upgrade() -> None:
    """Add them; certificates of versions that were revoked after their issue are withdrawn from then on."""
    op.create_table(
        "certificate_withdrawals",
        sa.Column("id", _ROW_ID, autoincrement=True, nullable=False),
        sa.Column("number", sa.String(100), nullable=False),
        sa.Column("by", sa.String(200), nullable=False),
        sa.Column("by_key", sa.String(100), nullable=True),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=False),
        sa.Column("certification_id", _ROW_ID, nullable=True),
        sa.ForeignKeyConstraint(
            ["number"], ["certificates.number"], name=op.f("fk_certificate_withdrawals_number_certificates")
        ),
        sa.ForeignKeyConstraint(
            ["certification_id"],
            ["certifications.id"],
            name=op.f("fk_certificate_withdrawals_certification_id_certifications"),
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_certificate_withdrawals")),
        sa.UniqueConstraint("number", name=op.f("uq_certificate_withdrawals_number")),
    )
    op.create_table(
        "release_requests",
        sa.Column("id", _ROW_ID, autoincrement=True, nullable=False),
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("by", sa.String(200), nullable=False),
        sa.Column("by_key", sa.String(100), nullable=False),
        sa.Column("reason", sa.Text(), nullable=False),
        sa.Column("at", sa.BigInteger(), nullable=False),
        sa.Column("due_days", sa.Integer(), nullable=True),
        sa.Column("override", sa.Boolean(), nullable=False),
        sa.Column("after_act", _ROW_ID, nullable=False),
        sa.ForeignKeyConstraint(
            ["serial", "version"],
            ["calibrations.serial", "calibrations.version"],
            name=op.f("fk_release_requests_serial_calibrations"),
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_release_requests")),
    )
    op.create_index(op.f("ix_release_requests_serial_id"), "release_requests", ["serial", "id"])
    op.create_table(
        "calibration_fetches",
        sa.Column("serial", sa.String(200), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("who", sa.String(100), nullable=False),
        sa.Column("first_at", sa.BigInteger(), nullable=False),
        sa.Column("last_at", sa.BigInteger(), nullable=False),
        sa.ForeignKeyConstraint(
            ["serial", "version"],
            ["calibrations.serial", "calibrations.version"],
            name=op.f("fk_calibration_fetches_serial_calibrations"),
        ),
        sa.PrimaryKeyConstraint("serial", "version", "who", name=op.f("pk_calibration_fetches")),
    )
    for table, name, kind in _ADDED:
        op.add_column(table, sa.Column(name, kind, nullable=True))
    if not context.is_offline_mode():
        from labctl.store.repositories.withdrawals import withdraw_of_revocations  # noqa: PLC0415  as in 0017

        withdraw_of_revocations(op.get_bind())


def downgrade() -> None:
    """Remove them."""
    for table, name, _ in reversed(_ADDED):
        op.drop_column(table, name)
    for table in ("calibration_fetches", "release_requests", "certificate_withdrawals"):
        op.drop_table(table)
