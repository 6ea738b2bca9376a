"""The error that all turns of a recording have in common, which their number does not reduce."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.mean_noise import response_dps
from labctl.fitting.numeric.least_squares import Solution


def with_common_error(data: FitData, axis: str, columns: NDArray[np.float64], solution: Solution) -> Solution:
    """Return a solution whose covariance holds the turns' common error, `turn_common_u` of recording.toml.

    A common relative error of all angles is an equal and opposite relative error of scale factor and
    misalignment together (GUM F.1.2.3). `columns` (m, k) are the model's, the first k of the solution's.
    """
    share = data.info.turn_common_u
    if not share or data.info.motion != "turns":
        return solution
    along, *_ = np.linalg.lstsq(columns, response_dps(data.channels.rates, data.outputs[axis]), rcond=None)
    along = np.concatenate([along, np.zeros(len(solution.values) - columns.shape[1])])
    return replace(solution, covariance=solution.covariance + share**2 * np.outer(along, along))
