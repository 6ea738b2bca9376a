"""Where a worker of a cluster reads what its task needs: the database, which it opens by its address for reading."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from labctl.store import Store, StoreAddress, open_store


@dataclass(frozen=True)
class Source:
    """The database of a job; it can be pickled."""

    address: StoreAddress

    @contextmanager
    def open(self) -> Iterator[Store]:
        """Open the database for reading. Raises StoreError."""
        with open_store(self.address.location, write=False) as store:
            yield store
