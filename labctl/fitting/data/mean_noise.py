"""Noise of a data-set mean that its own readings show: white noise, and what the steps of a coarse output leave."""

from __future__ import annotations

import numpy as np

from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.quantisation import QUANTISATION


def white_var_of(points: Recording, axis: str) -> Array | None:
    """Return the variance of each mean of one output, (m,) (deg/s)^2; None without spread or number of readings."""
    columns = points.columns
    spread = columns.get(f"gyro_{axis}_white_std", columns.get(f"gyro_{axis}_std"))
    if spread is None or "n" not in columns:
        return None
    variance = (np.asarray(spread, dtype=np.float64) / _scale(points, axis)) ** 2
    return np.asarray(variance / np.maximum(np.asarray(columns["n"]), 1) + quantisation_var_of(points, axis))


def quantisation_var_of(points: Recording, axis: str) -> Array:
    """Return what the steps of one output leave in each mean, (m,) (deg/s)^2; 0 where they are not coarse."""
    left = points.columns.get(f"gyro_{axis}{QUANTISATION}")
    if left is None:
        return np.zeros(len(points))
    return np.asarray((np.asarray(left, dtype=np.float64) / _scale(points, axis)) ** 2)


def _scale(points: Recording, axis: str) -> float:
    output = next((unit for name, unit in points.info.output.items() if name == axis), None)
    return abs(output.scale) if output else 1.0
