"""What a unit will drift by, predicted from its own intervals between calibrations, or from other units of its type.

The drift of one unit is drawn from a population with a mean and a spread, both estimated from few units: an evaluation
of type A (GUM 4.2) with random effects, by the means of units that count alike, however many intervals each has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import COVERAGE_PROBABILITY, MAX_FREEDOM
from labctl.fitting.uncertainty.combination import half_width

#: Units without which nothing is said of a population: two degrees of freedom, and k = 4.5.
MIN_UNITS = 3


@dataclass(frozen=True)
class DriftPrediction:
    """Drift of a unit in a year to come, at places: expected value, standard uncertainty and degrees of freedom."""

    mean_dps: Array  #: (places,)
    u_dps: Array  #: (places,)
    freedom: Array  #: (places,)

    @property
    def expanded_about_mean_dps(self) -> Array:
        """Half width about the mean that covers as often as U, (places,), by Student's t (GUM G.3)."""
        return np.asarray(
            stdtrit(np.clip(self.freedom, 1.0, MAX_FREEDOM), 0.5 * (1.0 + COVERAGE_PROBABILITY)) * self.u_dps
        )


def of_item(rates_dps: Array) -> DriftPrediction:
    """Return what a unit's own intervals say, (intervals, places) deg/s per year; NaN where one is not known.

    The drift to come has the root mean square of the past, and no sign: an interval is a degree of freedom. A steady
    drift is covered as well as one that changes from interval to interval. Each place has at least one interval.
    """
    n_finite = np.isfinite(rates_dps).sum(axis=0)
    root = np.sqrt(np.nansum(np.square(rates_dps), axis=0) / n_finite)
    return DriftPrediction(np.zeros(rates_dps.shape[1]), root, n_finite.astype(np.float64))


def of_type(rates_dps: Array, years: Array) -> DriftPrediction:
    """Return what the drifts of other units say of one more unit of their population.

    `rates_dps` (units, intervals, places) deg/s per year is NaN where an interval is not known, `years` (units,
    intervals) is how long each was. Each place has at least two units. The variance of a rate to come is that between
    units, that of their mean, and that between the intervals of one unit; the degrees of freedom are effective ones
    (Welch-Satterthwaite). What the calibrations measured wrongly is in these variances: it is taken for drift.
    """
    is_finite = np.isfinite(rates_dps)
    time = np.where(is_finite, years[:, :, np.newaxis], 0.0)
    span = time.sum(axis=1, keepdims=True)
    share = np.divide(time, span, out=np.zeros_like(time), where=span > 0)
    filled = np.where(is_finite, rates_dps, 0.0)
    of_unit = (share * filled).sum(axis=1)  # change over the whole history by its length, (units, places)
    counted = span[:, 0] > 0
    units, intervals = counted.sum(axis=0), is_finite.sum(axis=1)
    mean = of_unit.sum(axis=0) / units
    between = (np.where(counted, of_unit - mean, 0.0) ** 2).sum(axis=0) / (units - 1)
    squares = (np.where(is_finite, filled - of_unit[:, np.newaxis], 0.0) ** 2).sum(axis=(0, 1))
    same = (share**2).sum(axis=1)  # variance of a unit's rate, of that of an interval
    expected = np.where(counted, intervals - 2 + intervals * same, 0.0).sum(axis=0)
    within = np.divide(squares, expected, out=np.zeros_like(squares), where=expected > 1e-9)
    parts = np.stack([between * (1 + 1 / units), within * np.where(counted, 1 - same, 0.0).sum(axis=0) / units])
    freedom = np.stack([units - 1, np.maximum(intervals.sum(axis=0) - units, 1)])
    variance, estimated = parts.sum(axis=0), (parts**2 / freedom).sum(axis=0)
    effective = np.divide(variance**2, estimated, out=(units - 1).astype(np.float64), where=estimated > 0)
    return DriftPrediction(mean, np.sqrt(variance), effective)


def with_drift(expanded_dps: float, expanded_about_mean_dps: float, mean_dps: float) -> float:
    """Return the half width that covers a corrected rate with an expanded uncertainty after a drift, deg/s.

    The mean of a drift is a known error that is not corrected; its spread is independent of the calibration.
    """
    return half_width(math.hypot(expanded_dps, expanded_about_mean_dps), mean_dps)
