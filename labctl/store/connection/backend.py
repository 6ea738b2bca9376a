"""What a kind of database does besides running statements: SQLite guards its file, PostgreSQL is a server elsewhere."""

from __future__ import annotations

from typing import Protocol

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.store.connection.writer_lock import ServiceAddress
from labctl.store.manifests.chain import ChainHead


class Backend(Protocol):
    """The hooks of `Database`, in the order in which it calls them."""

    patience_s: float  #: for how long a database that does not answer is asked again, s

    def engines(self) -> tuple[sa.Engine, sa.Engine]:
        """Return the engine that writes and the engine that reads."""
        ...

    def before_opening(self, connection: sa.Connection) -> None:
        """Refuse a database that must not be written to. Raises StoreError."""
        ...

    def before_migration(self, connection: sa.Connection) -> None:
        """Wait for another process that migrates. Raises DatabaseError."""
        ...

    def opened(self, engine: sa.Engine) -> None:
        """Take note that the database is there, at its newest revision."""
        ...

    def refuse_other(self) -> None:
        """Raise StoreError when the database is no longer the one that was opened."""
        ...

    def before_begin(self, engine: sa.Engine, *, synced: bool) -> None:
        """Prepare the writing connection for a transaction that has to outlive a power cut, or need not."""
        ...

    def begun(self, connection: sa.Connection, *, synced: bool) -> int:
        """Begin a transaction; returns its number, 0 where it has none. Raises DatabaseError."""
        ...

    def before_commit(self, connection: sa.Connection, *, synced: bool) -> int:
        """Return how many commits the database counts with this one, 0 where it counts none."""
        ...

    def committed(self, commits: int) -> None:
        """Note the count that `before_commit` returned, once the transaction is committed."""
        ...

    @property
    def anchor_fits(self) -> bool:
        """Whether the chain of manifests goes on from what was noted outside the database."""
        ...

    def grown(self, head: ChainHead) -> None:
        """Note the end of the chain of manifests, once the transaction that added to it is committed."""
        ...

    def is_unreachable(self, error: exc.DatabaseError) -> bool:
        """Return whether an error says that the database cannot be reached, and nothing of the statement."""
        ...

    def is_disk_full(self, error: exc.DatabaseError) -> bool:
        """Return whether an error says that there is no room."""
        ...

    def words_for(self, error: exc.DatabaseError) -> str:
        """Return labctl's own message for an error; empty where the database's own message is enough."""
        ...

    def was_committed(self, number: int) -> bool:
        """Return whether a transaction was committed whose commit was not answered. Raises DatabaseError."""
        ...

    def note_address(self, address: ServiceAddress) -> None:
        """Write down at which address the service that holds this database is reached."""
        ...

    def close(self) -> None:
        """Let the next writer in. Safe to call twice."""
        ...
