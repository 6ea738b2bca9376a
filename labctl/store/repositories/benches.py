"""Benches: what the last safe state could not confirm, until a person has inspected the bench and confirmed it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories import audit
from labctl.store.repositories.records_by_name import record_of, records_of
from labctl.store.schema import tables


@dataclass(frozen=True)
class BenchRow:
    """A bench that was used with this database."""

    name: str
    last_used_at: datetime
    unconfirmed: str  #: what the safe state could not confirm; empty when all is well
    unconfirmed_at: datetime | None
    attempts: int = 0  #: how often the safe state was tried again since
    attempted_at: datetime | None = None
    confirmed_at: datetime | None = None  #: by such an attempt; `unconfirmed` stays until a person clears it

    @property
    def is_unconfirmed(self) -> bool:
        """Whether it is not known that the bench is in its safe state."""
        return bool(self.unconfirmed) and self.confirmed_at is None


_B = tables.benches.c
_ROWS = sa.select(
    _B.name, _B.last_used_at, _B.unconfirmed, _B.unconfirmed_at, _B.attempts, _B.attempted_at, _B.confirmed_at
).order_by(_B.name)
_UNTRIED: dict[str, Any] = {"unconfirmed": "", "attempts": 0, "attempted_at": None, "confirmed_at": None}


class Benches:
    """The benches that this database has seen."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[BenchRow]:
        """Return every bench, by name."""
        with self._database.reading() as connection:
            return records_of(BenchRow, connection.execute(_ROWS))

    def get(self, name: str) -> BenchRow | None:
        """Return a bench; None for one that was never used with this database."""
        return next((row for row in self.all() if row.name == name), None)

    def unconfirmed(self, name: str) -> str:
        """Return what the last safe state of a bench did not confirm; empty for nothing, or a bench never used."""
        row = self.get(name)
        return "" if row is None else row.unconfirmed

    @transaction
    def mark(self, name: str, unconfirmed: str, at: datetime) -> None:
        """Write down what could not be confirmed; it stays until `clear`."""
        with self._database.writing() as connection:
            mark(connection, name, unconfirmed, at)

    @transaction
    def attempted(self, name: str, unconfirmed: str, at: datetime) -> None:
        """Write down an attempt at the safe state of an unconfirmed bench, and what is unconfirmed after it.

        Every attempt is counted and dated on the bench. The audit trail gets a row for the first one, for one with
        another result than before, and for the one that confirms the safe state (`unconfirmed` is empty).
        """
        b = tables.benches
        with self._database.writing() as connection:
            row = connection.execute(_ROWS.where(b.c.name == name)).mappings().one_or_none()
            record = None if row is None else record_of(BenchRow, row)
            if record is None or not record.is_unconfirmed:  # a person was quicker
                return
            was, attempts = record.unconfirmed, record.attempts + 1
            values = {"attempts": attempts, "attempted_at": at}
            values |= {"unconfirmed": unconfirmed} if unconfirmed else {"confirmed_at": at}
            connection.execute(sa.update(b).where(b.c.name == name).values(values))
            if attempts == 1 or unconfirmed != was:
                detail = {"attempt": attempts, "confirmed": not unconfirmed, "unconfirmed": unconfirmed, "was": was}
                audit.append(connection, at, "bench safe state", f"bench {name}", detail)

    @transaction
    def clear(self, name: str, by: str, reason: str, at: datetime) -> BenchRow:
        """Record that a person has inspected the bench. Raises NotFound, and Conflict when there is nothing to
        clear."""
        bench = self.get(name)
        if bench is None:
            raise NotFound(
                f"bench {name!r} was never used with this database; `labctl bench status` lists the benches that were"
            )
        if not bench.unconfirmed:
            raise Conflict(f"bench {name}: its safe state is confirmed already; start a campaign")
        b = tables.benches
        with self._database.writing() as connection:
            connection.execute(sa.update(b).where(b.c.name == name).values({**_UNTRIED, "unconfirmed_at": None}))
            detail = {"reason": reason, "was": bench.unconfirmed}
            audit.append(connection, at, "bench clear", f"bench {name}", detail, who=by)
        return next(row for row in self.all() if row.name == name)


def mark(connection: sa.Connection, name: str, unconfirmed: str, at: datetime) -> None:
    """Write down, with whatever else the transaction does, what could not be confirmed of a bench."""
    b = tables.benches
    values = {**_UNTRIED, "unconfirmed": unconfirmed, "unconfirmed_at": at}
    connection.execute(sa.update(b).where(b.c.name == name).values(values))
