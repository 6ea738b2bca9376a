"""A straight line through figures of different days: generalised least squares, repeatability as noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from labctl.fitting.numeric.arrays import Array

#: Least number of points for an uncertainty of the slope.
MIN_POINTS = 3
#: Probability of the intervals.
COVERAGE_PROBABILITY = 0.95
#: Extrapolation: how far, in the unit of the times, and in how many steps.
HORIZON, STEPS = 50.0, 5000


@dataclass(frozen=True)
class TrendLine:
    """Value at time 0 and slope with their covariance; the covariance is NaN with fewer than three points."""

    value: float
    slope: float
    covariance: NDArray[np.float64]  #: (2, 2)
    repeatability: float | None  #: standard deviation from day to day beside each point's own uncertainty
    freedom: int  #: points less 2

    @property
    def factor(self) -> float:
        """Student's t of a 95 % interval; NaN without a degree of freedom."""
        return float(stdtrit(self.freedom, (1 + COVERAGE_PROBABILITY) / 2)) if self.freedom > 0 else float("nan")

    @property
    def u_slope(self) -> float:
        """Standard uncertainty of the slope."""
        return float(np.sqrt(self.covariance[1, 1]))

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return the line at times (n,), and the half width of its 95 % interval, (n,) each."""
        variance = self.covariance[0, 0] + 2 * time * self.covariance[0, 1] + time**2 * self.covariance[1, 1]
        return self.value + self.slope * time, self.factor * np.sqrt(np.maximum(variance, 0.0))

    def leaves(self, limit: float, after: float) -> tuple[float | None, float | None, float | None]:
        """Return when the magnitude of the line exceeds a limit after a time: expected, earliest and latest of 95 %.

        None: not within 50 years after it; the earliest is None without an uncertainty.
        """
        times = after + np.linspace(0.0, HORIZON, STEPS + 1)
        value, half = self.at(times)
        least = np.maximum(np.abs(value) - half, 0.0)
        return _first(times, np.abs(value) > limit), _first(times, np.abs(value) + half > limit), _first(
            times, least > limit
        )  # fmt: skip


def _first(times: Array, outside: NDArray[np.bool_]) -> float | None:
    return float(times[int(np.argmax(outside))]) if outside.any() else None


def trend_line(time: Array, values: Array, u: Array) -> TrendLine | None:
    """Return the line through values (n,) with standard uncertainties `u` (n,) at times (n,); None below two times.

    The repeatability is that with which chi2 is its expectation (Paule and Mandel 1982), 0 where the points scatter by
    less than their own uncertainties.
    """
    if len(np.unique(time)) < 2:
        return None
    freedom = len(time) - 2
    if freedom < 1:
        value, slope, _, _ = _weighted(time, values, np.ones(len(time)))  # through both points, whatever their weights
        return TrendLine(value, slope, np.full((2, 2), np.nan), None, 0)

    from scipy.optimize import brentq

    def excess(variance: float) -> float:
        return _weighted(time, values, u**2 + variance)[3] - freedom

    largest = float(np.var(values)) * len(values) + 1e-300
    least = 1e-12 * largest
    variance = brentq(excess, least, largest, xtol=1e-12 * largest) if excess(least) > 0 > excess(largest) else 0.0
    value, slope, covariance, _ = _weighted(time, values, u**2 + max(float(variance), least))
    return TrendLine(value, slope, covariance, float(np.sqrt(variance)), freedom)


def _weighted(time: Array, values: Array, variance: Array) -> tuple[float, float, NDArray[np.float64], float]:
    """Return value at 0, slope, their covariance and chi2."""
    root = 1.0 / np.sqrt(variance)
    columns = np.column_stack([root, root * time])
    covariance: NDArray[np.float64] = np.asarray(np.linalg.pinv(columns.T @ columns), dtype=np.float64)
    coefficients = covariance @ (columns.T @ (root * values))
    residual = root * values - columns @ coefficients
    return float(coefficients[0]), float(coefficients[1]), covariance, float(residual @ residual)
