"""Benches: what the last safe state could not confirm, until a person has looked and said so."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.errors import Conflict, NotFound
from labctl.store.connection.database import Database
from labctl.store.connection.transactions import transaction
from labctl.store.repositories import audit
from labctl.store.schema import tables


@dataclass(frozen=True)
class BenchRow:
    """A bench that was used with this database."""

    name: str
    last_used_at: datetime
    unconfirmed: str  #: what the safe state could not confirm; empty when all is well
    unconfirmed_at: datetime | None


class Benches:
    """The benches that this database has seen."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> list[BenchRow]:
        """Return every bench, by name."""
        b = tables.benches.c
        query = sa.select(b.name, b.last_used_at, b.unconfirmed, b.unconfirmed_at).order_by(b.name)
        with self._database.reading() as connection:
            return [BenchRow(*row) for row in connection.execute(query)]

    def unconfirmed(self, name: str) -> str:
        """Return what the last safe state of a bench did not confirm; empty for nothing, or a bench never used."""
        return next((row.unconfirmed for row in self.all() if row.name == name), "")

    @transaction
    def mark(self, name: str, unconfirmed: str, at: datetime) -> None:
        """Write down what could not be confirmed; it stays until `clear`."""
        with self._database.writing() as connection:
            mark(connection, name, unconfirmed, at)

    @transaction
    def clear(self, name: str, by: str, reason: str, at: datetime) -> BenchRow:
        """Take in that a person has looked. Raises NotFound, and Conflict when there is nothing to clear."""
        found = next((row for row in self.all() if row.name == name), None)
        if found is None:
            raise NotFound(f"bench {name!r} was never used with this database; `labctl bench status` lists them")
        if not found.unconfirmed:
            raise Conflict(f"bench {name}: nothing is unconfirmed")
        b = tables.benches
        with self._database.writing() as connection:
            connection.execute(sa.update(b).where(b.c.name == name).values(unconfirmed="", unconfirmed_at=None))
            detail = {"reason": reason, "was": found.unconfirmed}
            audit.append(connection, at, "bench clear", f"bench {name}", detail, who=by)
        return next(row for row in self.all() if row.name == name)


def mark(connection: sa.Connection, name: str, unconfirmed: str, at: datetime) -> None:
    """Write down, with whatever else the transaction does, what could not be confirmed of a bench."""
    b = tables.benches
    connection.execute(sa.update(b).where(b.c.name == name).values(unconfirmed=unconfirmed, unconfirmed_at=at))
