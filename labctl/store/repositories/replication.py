"""How far a replica of PostgreSQL is behind the server that it copies.

PostgreSQL 15 documentation: 9.27.4 (pg_is_in_recovery, pg_last_xact_replay_timestamp), 28.2.5 (pg_stat_wal_receiver).
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from labctl.store.connection.database import Database

# The view has a row while the replica is connected to its server; every user sees that, not the rest of the row.
_STATE = sa.text(
    """
    SELECT pg_last_xact_replay_timestamp() AS last_change_at,
           extract(epoch FROM clock_timestamp() - pg_last_xact_replay_timestamp())::float AS age_s,
           EXISTS (SELECT FROM pg_stat_wal_receiver) AS is_connected
    WHERE pg_is_in_recovery()
    """
)


@dataclass(frozen=True)
class ReplicaState:
    """How old the data of a replica are."""

    last_change_at: datetime | None  #: when the newest change that is here was made, UTC; None: not since its start
    age_s: float | None  #: time since then by the clock of the replica: the data are not older, s
    is_connected: bool  #: whether the replica receives changes from its server


class Replication:
    """Whether the database is a replica."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def state(self) -> ReplicaState | None:
        """Return how old the data of a replica are; None where the database is none. Raises StoreError."""
        with self._database.reading() as connection:
            if connection.dialect.name != "postgresql":
                return None
            row = connection.execute(_STATE).first()
        return None if row is None else ReplicaState(row.last_change_at, row.age_s, row.is_connected)
