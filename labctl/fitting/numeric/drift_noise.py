"""Noise of data-set means: white noise, drift between means, and a part that grows with rate.

The drift is an Ornstein-Uhlenbeck process inside each powered run, independent between runs. It is not plugged in as
one estimate: a grid of drifts is weighted by the restricted likelihood of the data, and the fit is averaged over it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Drift time constants tried, in units of the median spacing of data sets; the first is white from set to set.
TAU_SPACINGS = (0.25, 3.0, 12.0, 50.0, 200.0)
#: Drift sizes tried, in units of the scatter that white noise does not explain.
DRIFT_SIZES = (0.0, 0.35, 0.6, 0.8, 1.0, 1.3, 1.7, 2.3, 3.2)
#: No drift is larger than this many times half the bias stability: what is left beyond it is the model's fault.
LARGEST = 12.0
#: The usual bias stability, deg/s, where no data sheet says it.
USUAL_STABILITY_DPS = 0.004
#: Prior width of the drift about half the data sheet's bias stability: a factor.
PRIOR_FACTOR = 2.5


@dataclass(frozen=True)
class Scatter:
    """What is known of the noise of m data-set means before a drift is chosen.

    `white_var` (m,) is the variance of each mean from white noise within the set; None when the readings behind the
    means are unknown, and then only ratios are, and the overall size comes from the residuals.
    """

    t_s: Array
    run: NDArray[np.int64]
    rate_dps: Array
    white_var: Array | None
    datasheet_drift_dps: float | None = None

    @property
    def largest_drift_dps(self) -> float:
        """The largest drift that is believed."""
        return LARGEST * (self.datasheet_drift_dps or USUAL_STABILITY_DPS) / 2


@dataclass(frozen=True)
class Drift:
    """One point of the grid: size, time constant, and the part that grows with rate."""

    drift_dps: float
    tau_s: float
    per_rate: float = 0.0  #: standard deviation per deg/s of table rate


def whitened(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Return values (m, k) with each drift's correlation taken out, (drifts, m, k), and the log determinants of the
    covariances, (drifts,).

    Row by row in time, as a Kalman filter goes: of an Ornstein-Uhlenbeck process only the last value matters, so it is
    the same as by the Cholesky factors, in a number of operations that grows with m and not with its cube.
    """
    size_var = np.array([drift.drift_dps**2 for drift in drifts])
    tau_s = np.array([drift.tau_s for drift in drifts])
    white = white_var + (np.array([[drift.per_rate] for drift in drifts]) * scatter.rate_dps) ** 2
    found = np.empty((len(drifts), *values.shape))
    log_det = np.zeros(len(drifts))
    expected, variance = np.zeros((len(drifts), values.shape[1])), size_var
    order = np.lexsort((scatter.t_s, scatter.run))
    for before, row in zip((None, *order[:-1]), order, strict=True):
        if before is None or scatter.run[before] != scatter.run[row]:
            expected, variance = np.zeros_like(expected), size_var
        else:
            kept = np.exp(-(scatter.t_s[row] - scatter.t_s[before]) / tau_s)
            expected, variance = kept[:, None] * expected, size_var + kept**2 * (variance - size_var)
        total = variance + white[:, row]
        surprise = values[row] - expected
        found[:, row] = surprise / np.sqrt(total)[:, None]
        log_det += np.log(total)
        expected = expected + (variance / total)[:, None] * surprise
        variance = variance * white[:, row] / total
    return found, log_det


def grid(scatter: Scatter, unexplained_dps: float, per_rate: float = 0.0) -> list[Drift]:
    """Return the drifts to average over, around the scatter that white noise leaves unexplained."""
    spacing = float(np.median(np.diff(np.sort(scatter.t_s)))) if len(scatter.t_s) > 1 else 1.0
    spacing = max(spacing, 1e-3)
    points = [Drift(0.0, spacing, per_rate)]
    points += [
        Drift(size * unexplained_dps, ratio * spacing, per_rate)
        for ratio in TAU_SPACINGS
        for size in DRIFT_SIZES
        if size > 0 and unexplained_dps > 0
    ]
    return points


def log_prior(scatter: Scatter, drift: Drift) -> float:
    """Return the log prior of a drift: log-normal about half the data sheet's figure where there is one, else flat."""
    if scatter.datasheet_drift_dps is None:
        return 0.0
    expected = scatter.datasheet_drift_dps / 2
    size = max(drift.drift_dps, 0.05 * expected)
    return float(-0.5 * (np.log(size / expected) / np.log(PRIOR_FACTOR)) ** 2)
