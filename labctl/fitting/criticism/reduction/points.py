"""Reduction of a recording of means: one coordinate per data set."""

from __future__ import annotations

import numpy as np

from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.fitting.data.channels import channels_of
from labctl.fitting.data.earth import up_rate_dps
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, to_points


def reduce_points(recording: Recording) -> ReducedRecording:
    """Return the means of a recording as its only coordinates, R = 1."""
    points = to_points(recording)
    channels = channels_of(points, up_rate_dps(points.info))
    m = len(points)
    white = _white_of_points(points)
    dataset = np.asarray(points.columns.get("dataset", np.arange(1, m + 1)), dtype=np.int64)
    return ReducedRecording(
        points.info, channels, np.ones((1, m, 1)), {}, {a: points.gyro_dps(a)[None, :] for a in points.info.axes},
        np.ones((1, m), dtype=bool), white, dataset,
    )  # fmt: skip


def _white_of_points(points: Recording) -> dict[str, Array] | None:
    """Return axis -> (m,) variance of a mean from white noise, (deg/s)^2; None without spread or number of readings."""
    found: dict[str, Array] = {}
    for axis in points.info.axes:
        spread = points.columns.get(f"gyro_{axis}_white_std", points.columns.get(f"gyro_{axis}_std"))
        if spread is None or "n" not in points.columns:
            return None
        scale = abs(points.info.output[axis].scale) if axis in points.info.output else 1.0
        level = float(np.sqrt(np.median((np.asarray(spread, dtype=np.float64) / scale) ** 2)))
        if not level > 0:
            return None
        found[axis] = level**2 / np.maximum(np.asarray(points.columns["n"], dtype=np.float64), 1.0)
    return found
