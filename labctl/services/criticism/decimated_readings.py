"""Readings of recordings at no more than a criticism needs, read beside this process while it loads its libraries."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from labctl.recording import Columns, Recording
from labctl.recording.decimation import decimate
from labctl.recording.points import longest_undivided_s, to_points
from labctl.services.forked import Forked
from labctl.services.recordings.loading import is_profile, motion_of
from labctl.store import RecordingRow, Store, open_store

if TYPE_CHECKING:
    from labctl.fitting.data.static_record import StaticRecord


#: The duration of a data set may be a spacing of readings longer than they span.
LONG_SHARE = 0.9


@dataclass(frozen=True)
class ReadRecording:
    """What a criticism takes of a recording: its readings, decimated, and its static record by all of them."""

    columns: Columns
    static: StaticRecord | None
    pieces: Mapping[int, Recording]  #: means of each data set that may be divided, as `points_of` takes them


#: Gives what a criticism takes of a recording.
Decimated = Callable[[RecordingRow], ReadRecording]


def is_decimated(row: RecordingRow) -> bool:
    """Return whether a criticism of a recording takes decimated readings; otherwise it takes means.

    Turns are integrals over all readings, and decimated readings of a rate that changes would be those of another rate.
    """
    return row.kind == "samples" and motion_of(row) not in {"turns", "poses"} and not is_profile(row)


def read_recording_of(store: Store, row: RecordingRow) -> ReadRecording:
    """Return what a criticism takes of the readings of a recording, each of which is read once."""
    from labctl.services.recordings.allan import StillReadings  # noqa: PLC0415  slow to import

    info = row.recording_info
    longest_s, still = longest_undivided_s(info.motion), StillReadings(store, row)
    parts, pieces = list[Columns](), {}
    for number, columns in store.recordings.iter_datasets(row.id):
        whole = Recording(info, columns, None)
        parts.append(decimate(whole).columns)
        still.add(number, columns)
        if LONG_SHARE * longest_s < np.ptp(np.asarray(columns["t_s"], dtype=np.float64)):
            pieces[number] = to_points(whole)
    together = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return ReadRecording(together, still.record(), pieces)


@contextmanager
def reading_beside(store: Store, rows: Sequence[RecordingRow]) -> Iterator[Decimated]:
    """Begin to read the recordings; gives the function that returns the readings of each when they are needed."""
    wanted = [row for row in rows if is_decimated(row)]

    def read() -> dict[int, ReadRecording]:
        with open_store(store.location, write=False, read_blocks=store.read_blocks) as second_store:
            return {row.id: read_recording_of(second_store, row) for row in wanted}

    with closing(Forked(read)) as forked:
        readings: dict[int, ReadRecording] = {}

        def decimated(row: RecordingRow) -> ReadRecording:
            if row.id not in readings:
                readings.update(forked.result() if forked.is_forked else {row.id: read_recording_of(store, row)})
            return readings[row.id]

        yield decimated
