"""Where a worker on another computer reads what its task needs: the database, or exported recordings by fsspec."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from labctl.extras import needs_extra
from labctl.services.fleet.task import FleetTask
from labctl.store import Store, StoreAddress, open_store


class Source(Protocol):
    """Gives a worker a store with the unit of a task; it can be pickled."""

    def open(self, task: FleetTask) -> contextmanager[Store]:  # type: ignore[valid-type]
        """Open the store for reading. Raises StoreError, BadInput."""
        ...


@dataclass(frozen=True)
class DatabaseSource:
    """The database itself, which workers can reach, for reading."""

    address: StoreAddress

    @contextmanager
    def open(self, task: FleetTask) -> Iterator[Store]:  # noqa: ARG002  one interface for all sources
        """Open the database for reading. Raises StoreError."""
        with open_store(self.address.location, write=False) as store:
            yield store
