"""Readings of recordings at no more than a criticism needs, read beside this process while it loads its libraries."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from labctl.recording import Columns, Recording, RecordingInfo
from labctl.recording.decimation import decimate
from labctl.services.forked import Forked
from labctl.services.recordings.loading import is_profile, motion_of
from labctl.store import RecordingRow, Store, open_store

if TYPE_CHECKING:
    from labctl.fitting.data.static_record import StaticRecord


@dataclass(frozen=True)
class ReadRecording:
    """What a criticism takes of a recording: its readings, decimated, and its static record by all of them."""

    columns: Columns
    static: StaticRecord | None


#: Gives what a criticism takes of a recording.
Decimated = Callable[[RecordingRow], ReadRecording]


def is_decimated(row: RecordingRow) -> bool:
    """Return whether a criticism of a recording takes decimated readings; otherwise it takes means.

    Turns are integrals over all readings, and decimated readings of a rate that changes would be those of another rate.
    """
    return row.kind == "samples" and motion_of(row) not in {"turns", "poses"} and not is_profile(row)


def read_recording_of(store: Store, row: RecordingRow) -> ReadRecording:
    """Return the readings of a recording, decimated data set by data set, and its static record."""
    from labctl.services.recordings.allan import static_record_of  # noqa: PLC0415  slow to import

    info = RecordingInfo.model_validate(row.info)
    parts = [decimate(Recording(info, columns, None)).columns for _, columns in store.recordings.iter_datasets(row.id)]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return ReadRecording(columns, static_record_of(store, row))


@contextmanager
def reading_beside(store: Store, rows: Sequence[RecordingRow]) -> Iterator[Decimated]:
    """Begin to read the recordings; gives the function that returns the readings of each when they are needed."""
    decimated_rows = [row for row in rows if is_decimated(row)]

    def read() -> dict[int, ReadRecording]:
        with open_store(store.location, write=False) as own:
            return {row.id: read_recording_of(own, row) for row in decimated_rows}

    with closing(Forked(read)) as forked:
        readings: dict[int, ReadRecording] = {}

        def decimated(row: RecordingRow) -> ReadRecording:
            if not forked.is_forked:
                return read_recording_of(store, row)
            if not readings:
                readings.update(forked.result())
            return readings[row.id]

        yield decimated
