"""How many data sets one recording may have, and how large their numbers may be: refused before anything is written."""

from __future__ import annotations

from pathlib import Path
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.info import RecordingInfo
from labctl.recording.points import dataset_starts
from labctl.recording.recording import Columns

#: Measured: 13 s of one core for so many of one reading, in 154 transactions; each is a row for every channel too.
#: The published schedules have up to 630.
MAX_DATA_SETS = 50_000
#: The largest number that every database keeps in such a column: 2^31 - 1.
LARGEST_NUMBER = (1 << 31) - 1
NUMBERS = ("dataset", "run", "mounting", "n")


def refuse_too_many_data_sets(where: Path | str, info: RecordingInfo, columns: Columns) -> None:
    """Raise BadRecording for a recording of more data sets than are imported at once."""
    if info.kind == "coefficients":
        return
    numbers = np.asarray(columns["dataset"], dtype=np.int64)
    sets = len(numbers) if info.kind == "points" else len(dataset_starts(numbers)) if len(numbers) else 0
    if sets > MAX_DATA_SETS:
        raise BadRecording(
            f"{where}: {sets} data sets; at most {MAX_DATA_SETS} are imported at once; divide the recording, or give "
            "readings at one rate and temperature one data set number (a data set is a series of readings, not a "
            "single reading)"
        )


def refuse_large_numbers(path: Path, columns: Columns) -> None:
    """Raise BadRecording for a number of a data set, run or mounting, or of readings, that not every database keeps."""
    for name in NUMBERS:
        values = columns.get(name)
        if values is None or not _are_whole(values):
            continue
        wrong = (values > LARGEST_NUMBER) | (values < -LARGEST_NUMBER)
        if wrong.any():
            row = int(np.argmax(wrong))
            raise BadRecording(
                f"{path}: column {name!r}, row {row + 1}: {values[row]} is beyond +-{LARGEST_NUMBER} (2^31 - "
                "1), the largest number that every database can store; count from 1"
            )


def _are_whole(values: NDArray[np.generic]) -> TypeGuard[NDArray[np.integer]]:
    return values.dtype.kind in "iu"
