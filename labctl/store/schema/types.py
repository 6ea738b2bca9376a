"""What all tables share: one metadata with named constraints, portable column types, and the usual columns.

Instants are aware UTC, kept as whole microseconds.
"""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import sqlalchemy as sa
from sqlalchemy.engine import Dialect

from procedures.contracts.campaign_state import CampaignState

metadata = sa.MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ck": "ck_%(table_name)s_%(constraint_name)s",
        "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class Instant(sa.TypeDecorator[datetime]):
    """An aware instant as whole microseconds since 1970; a naive datetime is refused."""

    impl = sa.BigInteger
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> int | None:  # noqa: ARG002
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value!r} has no time zone; give a time with a time zone")
        return (value - EPOCH) // timedelta(microseconds=1)

    def process_result_value(self, value: int | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        return None if value is None else EPOCH + timedelta(microseconds=int(value))


class StateOfCampaign(sa.TypeDecorator[CampaignState]):
    """The state of a campaign, kept as its word."""

    impl = sa.String(20)
    cache_ok = True

    def process_bind_param(self, value: CampaignState | None, dialect: Dialect) -> str | None:  # noqa: ARG002
        return None if value is None else CampaignState(value).value

    def process_result_value(self, value: str | None, dialect: Dialect) -> CampaignState | None:  # noqa: ARG002
        return None if value is None else CampaignState(value)


#: Texts that are sorted by their bytes; SQLite sorts every text so, a server by its language where nothing is said.
ByBytes = sa.Text().with_variant(sa.Text(collation="C"), "postgresql")

#: Whole numbers that count rows; SQLite numbers rows by itself only in a column of type INTEGER.
RowId = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def id_column() -> sa.Column[int]:
    """Return a primary key that the database counts."""
    return sa.Column("id", RowId, primary_key=True, autoincrement=True)


def recording_column() -> sa.Column[int]:
    """Return the reference to a recording."""
    return sa.Column("recording_id", RowId, sa.ForeignKey("recordings.id"), nullable=False)


def campaign_column() -> sa.Column[int]:
    """Return the reference to a campaign."""
    return sa.Column("campaign_id", RowId, sa.ForeignKey("campaigns.id"), nullable=False)
