"""Reduction of a recording of means: one coordinate per data set."""

from __future__ import annotations

import numpy as np

from labctl.fitting.criticism.reduction.reduced_recording import ReducedRecording
from labctl.fitting.data.channels import channels_of
from labctl.fitting.data.earth_rate import up_rate_dps
from labctl.fitting.data.mean_noise import quantisation_var_of, white_var_of
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, to_points

#: No mean is taken to be known better than to this share of the usual variance.
MIN_SHARE = 1e-6


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
    """Return axis -> (m,) variance of a mean from white noise, (deg/s)^2; None without spread or number of readings.

    One level of white noise for all data sets, and what coarse steps leave in each mean; for turns each has its own.
    """
    white_by_axis: dict[str, Array] = {}
    for axis in points.info.axes:
        variance = white_var_of(points, axis)
        if variance is None or not np.any(variance > 0):
            return None
        if points.info.motion == "turns":  # a rest is known far better than a turn
            white_by_axis[axis] = np.maximum(variance, MIN_SHARE * float(np.median(variance)))
            continue
        n = np.maximum(np.asarray(points.columns["n"], dtype=np.float64), 1.0)
        quantisation_var = quantisation_var_of(points, axis)
        white_by_axis[axis] = float(np.median((variance - quantisation_var) * n)) / n + quantisation_var
        if not np.all(white_by_axis[axis] > 0):
            return None
    return white_by_axis
