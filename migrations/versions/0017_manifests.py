"""Manifests: every record that is at rest is sealed as it is found, and said to be sealed by the migration."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import context, op

revision = "0017"
down_revision = "0016"

_ROW_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    """Add the tables, the digests of the blocks that are there, and a manifest of every record at rest."""
    op.create_table(
        "manifests",
        sa.Column("sequence", _ROW_ID, autoincrement=False, nullable=False),
        sa.Column("kind", sa.String(20), nullable=False),
        sa.Column("record", sa.String(300), nullable=False),
        sa.Column("act", sa.String(10), nullable=False),
        sa.Column("hash", sa.String(64), nullable=False),
        sa.Column("document", sa.LargeBinary(), nullable=False),
        sa.Column("signature", sa.LargeBinary(), nullable=True),
        sa.Column("signed_by", sa.String(64), nullable=True),
        sa.PrimaryKeyConstraint("sequence", name=op.f("pk_manifests")),
    )
    op.create_index(op.f("ix_manifests_kind_record_sequence"), "manifests", ["kind", "record", "sequence"])
    head = op.create_table(
        "manifest_head",
        sa.Column("id", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("length", sa.BigInteger(), nullable=False),
        sa.Column("hash", sa.String(64), nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_manifest_head")),
    )
    op.bulk_insert(head, [{"id": 1, "length": 0, "hash": "0" * 64}])
    op.create_table(
        "block_digests",
        sa.Column("recording_id", _ROW_ID, autoincrement=False, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("seq", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("readings", sa.String(64), nullable=False),
        sa.Column("temperatures", sa.String(64), nullable=False),
        sa.Column("table_rates", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(
            ["recording_id"], ["recordings.id"], name=op.f("fk_block_digests_recording_id_recordings")
        ),
        sa.PrimaryKeyConstraint("recording_id", "number", "seq", name=op.f("pk_block_digests")),
    )
    if not context.is_offline_mode():
        from labctl.store.sealing.first_seals import seal_all  # noqa: PLC0415  only where there are records

        seal_all(op.get_bind())


def downgrade() -> None:
    """Remove them, with every manifest."""
    for table in ("block_digests", "manifest_head", "manifests"):
        op.drop_table(table)
