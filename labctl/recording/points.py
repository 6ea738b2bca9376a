"""From readings to data sets: mean, standard deviation and number of the valid readings of each (Ojeda eqs. 5, 6)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.recording.recording import Recording
from labctl.recording.spread import LEAST_FOR_SPECTRUM, white_std

#: Columns that one data set has one value of: its first reading's.
FIRST = ("dataset", "position", "run", "mounting", "table_angle_deg")


def dataset_starts(dataset: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the row, (m,), at which each data set of (n,) rows begins."""
    return np.flatnonzero(np.concatenate([[True], dataset[1:] != dataset[:-1]]))


def to_points(recording: Recording) -> Recording:
    """Return the recording with one row per data set (kind "points"); points and coefficients return as they are.

    Only valid readings count. `t_s` is the middle of the data set, `table_angle_deg` its start, `duration_s` its
    length; each gyro column gains `_std` (n - 1) and, where every set has readings enough, `_white_std`; every row
    gains `n`. A data set without a valid reading is left out.
    """
    if recording.info.kind != "samples":
        return recording
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    rows = {name: np.asarray(values)[valid] for name, values in columns.items() if name != "valid"}
    starts = dataset_starts(rows["dataset"])
    counts = np.diff(np.append(starts, len(rows["dataset"])))
    points: dict[str, NDArray[Any]] = {}
    for name, values in rows.items():
        if name in FIRST or values.dtype.kind not in "fiu":
            points[name] = values[starts]
        elif name == "t_s":
            ends = values[starts + counts - 1]
            points[name] = (values[starts] + ends) / 2
            points["duration_s"] = (ends - values[starts]) * counts / np.maximum(counts - 1, 1)
        else:
            points[name], spread = _mean_and_std(values.astype(np.float64), starts, counts)
            if name.startswith("gyro_"):
                points[f"{name}_std"] = spread
                if counts.min() >= LEAST_FOR_SPECTRUM:
                    sets = np.split(values.astype(np.float64), starts[1:])
                    points[f"{name}_white_std"] = np.array([white_std(readings) for readings in sets])
    points["n"] = counts.astype(np.int64)
    return Recording(recording.info.model_copy(update={"kind": "points"}), points, recording.environment)


def _mean_and_std(
    values: NDArray[np.float64], starts: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    means = np.add.reduceat(values, starts) / counts
    squares = np.add.reduceat((values - np.repeat(means, counts)) ** 2, starts)
    return means, np.sqrt(squares / np.maximum(counts - 1, 1))
