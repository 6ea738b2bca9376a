"""The environment of the room: readings that a person typed or an instrument logged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.acting_user import acting_key
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories.audit import append
from labctl.store.repositories.records_by_name import records_of
from labctl.store.schema import tables


@dataclass(frozen=True)
class RoomReading:
    """One reading of one quantity."""

    measured_at: datetime
    bench_name: str  #: empty: of all benches of the laboratory
    quantity: str
    unit: str
    value: float
    source: str


@dataclass(frozen=True)
class RoomSpan:
    """Least and largest reading of a quantity over a time."""

    quantity: str
    unit: str
    low: float
    high: float
    readings: int
    first: datetime
    last: datetime


class RoomEnvironment:
    """What was read in the laboratory, beside its benches."""

    def __init__(self, database: Database) -> None:
        self._database = database

    @transaction
    def add(self, rows: Sequence[RoomReading], at: datetime, by: str | None) -> None:
        """Enter readings; `by` is the person who typed them, and then the act is audited."""
        if not rows:
            return
        with self._database.writing() as connection:
            connection.execute(sa.insert(tables.room_environment), [{**asdict(row), "at": at} for row in rows])
            if by is not None:
                typed = {f"{row.quantity} {row.unit}": row.value for row in rows}
                append(
                    connection, at, "environment", rows[0].bench_name or "all benches", typed, who=acting_key() or by
                )

    def readings(self, first: datetime, last: datetime, bench: str, limit: int) -> list[RoomReading]:
        """Return the newest readings between two instants that hold for a bench, at most `limit`, newest first."""
        r = tables.room_environment.c
        query = sa.select(r.measured_at, r.bench_name, r.quantity, r.unit, r.value, r.source)
        query = query.where(self._within(first, last, bench)).order_by(r.measured_at.desc(), r.id.desc()).limit(limit)
        with self._database.reading() as connection:
            return records_of(RoomReading, connection.execute(query))

    def spans(self, first: datetime, last: datetime, bench: str) -> list[RoomSpan]:
        """Return least and largest of each quantity between two instants that hold for a bench, by quantity."""
        r = tables.room_environment.c
        query = sa.select(
            r.quantity, r.unit, sa.func.min(r.value).label("low"), sa.func.max(r.value).label("high"),
            sa.func.count().label("readings"), sa.func.min(r.measured_at).label("first"),
            sa.func.max(r.measured_at).label("last"),
        ).where(self._within(first, last, bench)).group_by(r.quantity, r.unit).order_by(r.quantity)  # fmt: skip
        with self._database.reading() as connection:
            return records_of(RoomSpan, connection.execute(query))

    @staticmethod
    def _within(first: datetime, last: datetime, bench: str) -> sa.ColumnElement[bool]:
        r = tables.room_environment.c
        return sa.and_(r.measured_at >= first, r.measured_at <= last, r.bench_name.in_(("", bench)))
