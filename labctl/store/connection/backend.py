"""The hooks of `Database`: what a kind of database does at each of them; most kinds do nothing at most of them."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.store.connection.writer_lock import ServiceAddress
from labctl.store.manifests.chain import ChainHead


class Backend:
    """One kind of database. The hooks are in the order in which `Database` calls them; each default does nothing."""

    patience_s = 0.0  #: for how long a database that does not answer is asked again, s; a file is there, or it is not
    #: Whether the chain of manifests goes on from what was noted outside the database; nothing is noted by default.
    anchor_fits = True

    def engines(self) -> tuple[sa.Engine, sa.Engine]:
        """Return the engine that writes and the engine that reads."""
        raise NotImplementedError

    def lookup_connection(self) -> dict[str, Any] | None:
        """Return psycopg's arguments for a connection of lookups; None: they are read as all else is."""
        return None

    def before_opening(self, connection: sa.Connection) -> None:
        """Refuse a database that must not be written to. Raises StoreError."""

    def before_migration(self, connection: sa.Connection) -> None:
        """Wait for another process that migrates. Raises DatabaseError."""

    def after_migration(self, connection: sa.Connection) -> None:
        """Add what only this kind of database can have, in the transaction of the migration, and is not there yet."""

    def opened(self, engine: sa.Engine) -> None:
        """Take note that the database is there, at its newest revision."""

    def refuse_other(self) -> None:
        """Raise StoreError when the database is no longer the one that was opened."""

    def unchanged(self) -> AbstractContextManager[None]:
        """Raise StoreError at the end of the block when the database is not in the state of its begin any more.

        By default every reading sees one state of the database anyway.
        """
        return nullcontext()

    def before_begin(self, engine: sa.Engine, *, synced: bool) -> None:
        """Prepare the writing connection for a transaction that has to outlive a power cut, or need not."""

    def begun(self, connection: sa.Connection, *, synced: bool) -> int:  # noqa: ARG002
        """Begin a transaction; returns its number, 0 where it has none. Raises DatabaseError."""
        return 0

    def before_commit(self, connection: sa.Connection, *, synced: bool) -> int:  # noqa: ARG002
        """Return how many commits the database counts with this one, 0 where it counts none."""
        return 0

    def committed(self, commits: int) -> None:
        """Note the count that `before_commit` returned, once the transaction is committed."""

    def grown(self, head: ChainHead) -> None:
        """Note the end of the chain of manifests, once the transaction that added to it is committed."""

    def is_unreachable(self, error: exc.DatabaseError) -> bool:  # noqa: ARG002
        """Return whether an error says that the database cannot be reached, and nothing of the statement."""
        return False

    def is_disk_full(self, error: exc.DatabaseError) -> bool:
        """Return whether an error says that there is no room."""
        raise NotImplementedError

    def words_for(self, error: exc.DatabaseError) -> str:  # noqa: ARG002
        """Return labctl's own message for an error; empty where the database's own message is enough."""
        return ""

    def was_committed(self, number: int) -> bool:  # noqa: ARG002
        """Return whether a transaction was committed whose commit was not answered. Raises DatabaseError.

        By default a commit that failed was not made.
        """
        return False

    def note_address(self, address: ServiceAddress) -> None:
        """Write down at which address the service that holds this database is reached."""

    def close(self) -> None:
        """Release the writer's lock. Safe to call twice."""
