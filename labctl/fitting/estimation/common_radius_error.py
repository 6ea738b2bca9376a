"""The error of the distance from the table's axis, which all rows have in common and their number does not reduce."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.numeric.least_squares import Solution
from labctl.recording.positions import further

#: Step by which the change of the columns with the distance is found, mm; the centripetal acceleration is linear in it.
STEP_MM = 1


def with_radius_error(
    data: FitData,
    columns: NDArray[np.float64],
    columns_of: Callable[[FitData], NDArray[np.float64]],
    solution: Solution,
) -> Solution:
    """Return a solution whose covariance holds the error of the distance, standard `radius` of the bench.

    It is the same at all distances, because it is that of the place of the unit on its fixture. `columns` (m, k) are
    the model's, the first k of the solution's; `columns_of` returns them for other data.
    """
    u_m = float(
        np.hypot.reduce([each.standard_u for each in data.info.standards if each.quantity == "radius"] or [0.0])
    )
    if not u_m or "position" not in data.channels or not np.any(np.isfinite(data.channels.radius_m())):
        return solution
    channels = data.channels
    moved = {**channels.columns, "position": further(np.asarray(channels["position"]), STEP_MM)}
    change = columns_of(replace(data, channels=replace(channels, columns=moved))) - columns
    per_m = change @ solution.values[: columns.shape[1]] / (STEP_MM / 1000.0)
    along, *_ = np.linalg.lstsq(columns, per_m, rcond=None)
    along = np.concatenate([along, np.zeros(len(solution.values) - columns.shape[1])])
    return replace(solution, covariance=solution.covariance + u_m**2 * np.outer(along, along))
