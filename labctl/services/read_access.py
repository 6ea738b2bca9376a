"""Opening a database for reading, beside the process that writes to it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from labctl.config import default_database
from labctl.errors import StoreError
from labctl.store import Store, is_url, open_store


def acting_service(acts_at: str | None) -> str:
    """Return the name of the service that takes what a service that only reads refuses; `acts_at` is its address."""
    return acts_at or "a service that writes to this database; `labctl bench status` lists those with a bench"


@contextmanager
def open_readonly(database: str | None) -> Iterator[Store]:
    """Open the store for reading, also while another process writes."""
    with open_store(database or default_database(), write=False) as store:
        yield store


@contextmanager
def open_existing(database: str | None) -> Iterator[Store | None]:
    """Open the store for reading where there is one; None: no database was made yet, and none is made."""
    location = database or default_database()
    if not is_url(location) and not Path(location).is_file():
        yield None
        return
    with open_readonly(location) as store:
        yield store


@contextmanager
def open_readable(database: str | None) -> Iterator[Store | None]:
    """Open the store for reading, for a command that does without one; None: there is none, or it cannot be read."""
    with ExitStack() as opened:
        store = None
        with suppress(StoreError):
            store = opened.enter_context(open_existing(database))
        yield store
