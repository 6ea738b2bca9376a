"""Spread of a coefficient over units whose own uncertainties are known, by restricted likelihood (REML).

A value is mean + what the unit differs by + the error of its calibration: y ~ N(X b, tau^2 + u^2). The spread tau
maximises the restricted likelihood (Patterson and Thompson 1971), which does not count the estimated mean as known; its
interval is that of the likelihood ratio.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Fall of the log likelihood at the ends of a 95 % interval: half of 1.96 squared.
FALL = 1.9207294103470612
#: Spreads over which the likelihood is averaged for a unit to come, and how far beyond the interval, over its length.
POINTS, BEYOND = 48, 0.6
#: Spreads between which the maximum is searched for, over the root mean square of y, and steps of the first search.
MIN_SHARE, MAX_SHARE, STEPS = 1e-4, 10.0, 24
#: A spread whose log likelihood exceeds that of none by less is none: the search ends near zero, not there.
NO_EVIDENCE = 1e-6


@dataclass(frozen=True)
class RemlEstimate:
    """Standard deviation of a coefficient over the units of a type, with its 95 % interval, and the fit beside it."""

    tau: float
    low: float
    high: float
    predictive: float  #: root mean square of the spreads by their likelihood
    values: Array  #: (p,) coefficients of the columns: the mean, and shifts of groups
    covariance: NDArray[np.float64]  #: (p, p)
    chi2: float  #: sum of squared weighted residuals at tau


def reml(y: Array, variance: Array, columns: NDArray[np.float64]) -> RemlEstimate:
    """Return the spread of y (n,) with known variances (n,) beside columns (n, p); n is more than p."""
    centred = y - np.mean(y)
    scale = float(np.sqrt(np.mean(centred**2) + np.mean(variance)))
    scale = scale if scale > 0 else 1.0
    norms = np.linalg.norm(columns, axis=0) / np.sqrt(len(y))
    normed = columns / np.where(norms > 0, norms, 1.0)

    def loss(tau: float) -> float:
        return -_log_likelihood(tau * scale, centred, variance, normed)

    from scipy.optimize import minimize_scalar

    grid = np.geomspace(MIN_SHARE, MAX_SHARE, STEPS)
    if np.all(variance > 0):
        grid = np.append(0.0, grid)
    losses = np.array([loss(tau) for tau in grid.tolist()])
    best = int(np.argmin(losses))
    ends = (float(grid[max(best - 1, 0)]), float(grid[min(best + 1, len(grid) - 1)]))
    minimum = minimize_scalar(loss, bounds=ends, method="bounded", options={"xatol": 1e-7 * ends[1]})
    tau, least = (
        (float(minimum.x), float(minimum.fun)) if minimum.fun <= losses[best] else (float(grid[best]), losses[best])
    )
    if grid[0] == 0.0 and losses[0] - least < NO_EVIDENCE:
        tau, least = 0.0, losses[0]
    low, high = _interval(loss, tau, float(least), float(grid[0]), 4.0 * MAX_SHARE)
    values, covariance, chi2 = weighted_fit(y, variance + (tau * scale) ** 2, columns)
    predictive = _predictive(loss, low, high, float(least))
    return RemlEstimate(tau * scale, low * scale, high * scale, predictive * scale, values, covariance, chi2)


def weighted_fit(y: Array, variance: Array, columns: NDArray[np.float64]) -> tuple[Array, NDArray[np.float64], float]:
    """Return coefficients (p,), their covariance (p, p), and chi2 of a fit of y (n,) with variances (n,)."""
    root = 1.0 / np.sqrt(variance)
    q, r = np.linalg.qr(columns * root[:, None])
    projected = q.T @ (y * root)
    inverse = np.linalg.inv(r)
    residual = y * root - q @ projected
    return inverse @ projected, inverse @ inverse.T, float(residual @ residual)


def _log_likelihood(tau: float, y: Array, variance: Array, columns: NDArray[np.float64]) -> float:
    """Return the restricted log likelihood of a spread; the columns (n, p) are of comparable lengths."""
    total = variance + tau**2
    weighted = columns / total[:, None]
    information = weighted.T @ columns
    inner = weighted.T @ y
    chi2 = float(y @ (y / total) - inner @ np.linalg.solve(information, inner))
    return float(-0.5 * (np.log(total).sum() + np.linalg.slogdet(information)[1] + chi2))


def _interval(
    loss: Callable[[float], float], tau: float, least: float, lowest: float, highest: float
) -> tuple[float, float]:
    """Return where the log likelihood has fallen by `FALL` below and above its maximum."""

    from scipy.optimize import brentq

    def fallen(at: float) -> float:
        return loss(at) - least - FALL

    low = lowest if fallen(lowest) <= 0 else float(brentq(fallen, lowest, tau, xtol=1e-9, rtol=1e-6))
    high = highest if fallen(highest) <= 0 else float(brentq(fallen, tau, highest, xtol=1e-9, rtol=1e-6))
    return low, high


def _predictive(loss: Callable[[float], float], low: float, high: float, least: float) -> float:
    """Return the root mean square of the spread by its likelihood, every spread as likely before."""
    length = high - low
    taus = np.linspace(max(low - BEYOND * length, 1e-9), high + BEYOND * length, POINTS)
    weight = np.exp(least - np.array([loss(tau) for tau in taus.tolist()]))
    return float(np.sqrt(np.average(taus**2, weights=weight)))
