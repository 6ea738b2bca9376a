"""Noise of data-set means: white noise, drift between means, and a part that grows with rate.

The drift is an Ornstein-Uhlenbeck process inside each powered run, independent between runs. It is not plugged in as
one estimate: a grid of drifts is weighted by the restricted likelihood of the data, and the fit is averaged over it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs

from labctl.fitting.numeric.arrays import Array

#: Drift time constants tried, in units of the median spacing of data sets; the first is white from set to set.
TAU_SPACINGS = (0.25, 3.0, 12.0, 50.0, 200.0)
#: Drift sizes tried, in units of the scatter that white noise does not explain.
DRIFT_SIZES = (0.0, 0.35, 0.6, 0.8, 1.0, 1.3, 1.7, 2.3, 3.2)
#: No drift is larger than this many times half the bias stability: what is left beyond it is the model's fault.
LARGEST = 12.0
#: The usual bias stability, deg/s, where no data sheet says it.
USUAL_STABILITY_DPS = 0.004
#: Share of the evidence that a statement about the size of the drift needs.
MAX_EVIDENCE = 0.9
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
    datasheet_drift_dps: float | None = None  #: bias stability by the data sheet, a standard deviation

    @property
    def largest_drift_dps(self) -> float:
        """The largest drift that is believed."""
        return LARGEST * (self.datasheet_drift_dps or USUAL_STABILITY_DPS) / 2


@dataclass(frozen=True)
class Drift:
    """A point of the grid, or what was found over all of it: size, time constant, and the part that grows with rate."""

    drift_dps: float
    tau_s: float
    per_rate: float = 0.0  #: standard deviation per deg/s of table rate
    least_dps: float = 0.0  #: of a drift that was found: `MAX_EVIDENCE` is for this size or a larger one


def whitened(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], Array]:
    """Return values (m, k) whitened for each drift, (drifts, m, k), and log determinants of the covariances, (drifts,).

    The returned rows are in order of time. They are whitened one after the other, as in a Kalman filter: only the last
    value of an Ornstein-Uhlenbeck process matters, so the result is that of the Cholesky factors, in a number of
    operations that grows with m and not with its cube. The expectation of each row is a linear recurrence, solved for
    all columns at once.
    """
    order = np.lexsort((scatter.t_s, scatter.run))
    ordered = values[order]
    remaining, total, share = _filter(scatter, drifts, white_var, order)
    before, shares = (
        remaining * np.roll(share, 1, axis=1),
        remaining * np.roll(1.0 - share, 1, axis=1),
    )  # kept is 0 in the first row
    expect = _expected_of_one if len(drifts) == 1 else _expected_of_many
    expected = expect(ordered, before, shares)
    np.subtract(ordered, expected, out=expected)
    expected /= np.sqrt(total)[:, :, None]
    return expected, np.log(total).sum(axis=1)


def _expected_of_one(
    ordered: NDArray[np.float64], before: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return what is expected of each row (m, k) from those before it, (1, m, k): the solution of a banded system."""
    band = np.ones((2, len(ordered)))
    band[1, :-1] = -shares[0, 1:]
    pull = np.zeros_like(ordered, order="F")
    pull[1:] = before[0, 1:, None] * ordered[:-1]
    expected, _ = dtbtrs(band, pull, uplo="L", diag="U", overwrite_b=True)
    return np.asarray(expected)[None]


def _expected_of_many(
    ordered: NDArray[np.float64], before: NDArray[np.float64], shares: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the same for many drifts, (drifts, m, k), row by row for all of them at once."""
    expected = np.empty((len(ordered), len(before), ordered.shape[1]))
    expected[0] = 0.0
    np.multiply(before.T[1:, :, None], ordered[:-1, None, :], out=expected[1:])
    pull = np.empty(expected.shape[1:])
    for row, last, share in zip(expected[1:], expected[:-1], shares.T[1:, :, None], strict=True):
        np.multiply(share, last, out=pull)
        np.add(row, pull, out=row)
    return np.ascontiguousarray(expected.transpose(1, 0, 2))


def _filter(
    scatter: Scatter, drifts: Sequence[Drift], white_var: Array, order: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the terms of the recurrence for rows in order of time, (drifts, m) each.

    They are the share of the drift that is left since the row before (0 where a run begins), the variance of a row
    about its expectation, and the drift's share of that variance.
    """
    size_var, tau_s, per_rate = np.array([(d.drift_dps**2, d.tau_s, d.per_rate) for d in drifts]).T[:, :, None]
    begins = np.concatenate([[True], np.diff(scatter.run[order]) != 0])
    decay = np.where(begins, 0.0, np.exp(-np.diff(scatter.t_s[order], prepend=scatter.t_s[order[0]]) / tau_s))
    white = white_var[order] + (per_rate * scatter.rate_dps[order]) ** 2
    size: Any = size_var[:, 0]
    rows: Any = zip((decay**2).T, white.T, strict=True)
    if len(drifts) == 1:  # single numbers are faster than arrays of one
        size, rows = float(size[0]), zip((decay[0] ** 2).tolist(), white[0].tolist(), strict=True)
    variances, variance = [], size
    for part, noise in rows:
        before = size + part * (variance - size)
        variances.append(before)
        variance = before * noise / (before + noise)
    drift_var = np.array(variances).reshape(len(order), len(drifts)).T
    return decay, drift_var + white, drift_var / (drift_var + white)


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
