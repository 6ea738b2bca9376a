"""Bias of the gyro: its output in the rests."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.earth_rate import EARTH_RATE_DPS, up_rate_dps
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.drift_noise import Scatter
from labctl.fitting.numeric.least_squares import Solution, solve
from labctl.fitting.poses.at_rest.rests import Rests
from labctl.fitting.poses.readings import PoseReadings
from labctl.fitting.poses.triad import unit


@dataclass(frozen=True)
class Bias:
    """Bias of three axes, rest by rest, and over the recording with its sensitivity to specific force."""

    rest_dps: NDArray[np.float64]  #: (k, 3) without the effect of the specific force
    u_rest_dps: NDArray[np.float64]  #: (k, 3) standard uncertainty as the bias of the moves beside the rest
    solutions: tuple[Solution, ...]  #: three, bias and g-sensitivities (4,) of each axis, with the drift

    @property
    def mean_dps(self) -> Array:
        """The bias over the recording at 0 g, (3,)."""
        return np.array([float(solution.values[0]) for solution in self.solutions])

    @property
    def per_g(self) -> NDArray[np.float64]:
        """The bias that a specific force of one g adds, (3, 3) deg/s/g: axis of the gyro, axis of the force."""
        return np.array([solution.values[1:] for solution in self.solutions])


def bias_of(readings: PoseReadings, rests: Rests, force_g: NDArray[np.float64], used: NDArray[np.bool_]) -> Bias:
    """Return the bias in the rests with specific forces `force_g` (k, 3); its mean is over the `used` ones, (k,).

    Where the latitude is known the vertical part of the Earth's rate is taken off. Its horizontal part depends on
    the unknown heading; it is part of the scatter from pose to pose, and so of the uncertainty.
    """
    rest_rate_dps = rests.gyro_dps - up_rate_dps(readings.info) * unit(force_g)
    white = rests.gyro_white_var
    design = np.column_stack([np.ones(len(rests)), force_g])
    k = int(np.count_nonzero(used))

    def of(axis: int) -> Solution:
        stability = readings.info.stability_dps
        scatter = Scatter(rests.t_s[used], np.ones(k, dtype=np.int64), np.zeros(k), white[used, axis], stability)
        return solve(design[used], rest_rate_dps[used, axis], scatter)

    solutions = tuple(_with_earth(of(axis), axis, readings) for axis in range(3))
    per_g = np.array([solution.values[1:] for solution in solutions])
    residual = rest_rate_dps - force_g @ per_g.T
    change = np.diff(residual, axis=0)
    # robust: a disturbance in one rest, such as by the cable, is not a drift
    scatter = (1.4826 * np.median(np.abs(change), axis=0)) ** 2 / 2
    extra = np.maximum(scatter - np.median(white, axis=0), 0.0)
    return Bias(residual, np.sqrt(white + extra), solutions)


def _with_earth(solution: Solution, axis: int, readings: PoseReadings) -> Solution:
    """Return a solution (4,) with what an unknown latitude adds to the uncertainty of the own axis' g-sensitivity.

    The vertical part of the Earth's rate is parallel to the specific force in every pose, so the two are not separable.
    """
    if readings.info.latitude_deg is not None:
        return solution
    covariance = solution.covariance.copy()
    covariance[1 + axis, 1 + axis] += EARTH_RATE_DPS**2 / 3
    return replace(solution, covariance=covariance)
