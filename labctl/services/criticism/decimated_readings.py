"""Readings of recordings at no more than a criticism needs, read beside this process while it loads its libraries."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager

import numpy as np

from labctl.recording import Columns, Recording, RecordingInfo
from labctl.recording.decimation import decimate
from labctl.services.forked import Forked
from labctl.services.recordings.loading import is_profile, motion_of
from labctl.store import RecordingRow, Store, open_store

#: Gives the decimated readings of a recording, column by column.
Decimated = Callable[[RecordingRow], Columns]


def is_decimated(row: RecordingRow) -> bool:
    """Return whether a criticism of a recording takes decimated readings; otherwise it takes means.

    Turns are integrals over all readings, and decimated readings of a rate that changes would be those of another rate.
    """
    return row.kind == "samples" and motion_of(row) not in {"turns", "poses"} and not is_profile(row)


def decimated_columns_of(store: Store, row: RecordingRow) -> Columns:
    """Return the readings of a recording, decimated data set by data set."""
    info = RecordingInfo.model_validate(row.info)
    parts = [decimate(Recording(info, columns, None)).columns for _, columns in store.recordings.iter_datasets(row.id)]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


@contextmanager
def reading_beside(store: Store, rows: Sequence[RecordingRow]) -> Iterator[Decimated]:
    """Begin to read the recordings; gives the function that returns the readings of each when they are needed."""
    wanted = [row for row in rows if is_decimated(row)]

    def read() -> dict[int, Columns]:
        with open_store(store.location, write=False) as own:
            return {row.id: decimated_columns_of(own, row) for row in wanted}

    with closing(Forked(read)) as forked:
        found: dict[int, Columns] = {}

        def decimated(row: RecordingRow) -> Columns:
            if not forked.is_forked:
                return decimated_columns_of(store, row)
            if not found:
                found.update(forked.result())
            return found[row.id]

        yield decimated
