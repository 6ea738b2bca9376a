"""Where a task reads what it needs: the database by its address, and the readings there or in a storage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from labctl.services.recordings.staging import staging_folder
from labctl.store import PublishedReadings, Store, StoreAddress, open_store


@dataclass(frozen=True)
class Source:
    """The database of a job; it can be pickled."""

    address: StoreAddress

    @contextmanager
    def open(self) -> Iterator[Store]:
        """Open the database for reading. Raises StoreError."""
        with open_store(self.address.location, write=False) as store:
            yield store


def published_name(recording: int, file: str) -> str:
    """Return where a storage has a file of a recording."""
    return f"recording-{recording}/{file}"


@contextmanager
def readings_from(store: Store, url: str) -> Iterator[Store]:
    """Give a store whose readings are read from a storage and checked by the database; empty: the store itself.

    The files are copied to a folder of this computer meanwhile, each once. Raises BadInput where the storage cannot be
    used here.
    """
    if not url:
        yield store
        return
    from labctl.recording.object_storage import ObjectStorage  # noqa: PLC0415  loaded where there is a storage alone

    storage = ObjectStorage(url)

    def fetch(recording: int, file: str, target: Path, max_bytes: int) -> None:
        storage.fetch(published_name(recording, file), target, max_bytes)

    def shown(recording: int, file: str) -> str:
        return f"{storage.url}/{published_name(recording, file)}"

    with staging_folder() as folder:
        yield store.reading_from(PublishedReadings(fetch, folder, shown))


def refuse_missing_source(url: str) -> None:
    """Raise NotFound where a storage has nothing, BadInput where it cannot be used; empty: the database, which has."""
    if url:
        from labctl.recording.object_storage import ObjectStorage  # noqa: PLC0415  as above

        ObjectStorage(url).refuse_missing()
