"""Noise of data-set means: white noise, drift between means, and a part that grows with rate.

The drift is an Ornstein-Uhlenbeck process inside each powered run, independent between runs, or a sum of such processes
whose time constants lie evenly in their logarithm: flicker, as bias instability is (IEEE Std 952, annex C). It is not
plugged in as one estimate: a grid of drifts is weighted by the restricted likelihood of the data, and the fit is
averaged over it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Drift time constants tried, in units of the median spacing of data sets; the first is white from set to set.
TAU_SPACINGS = (0.25, 3.0, 12.0, 50.0, 200.0)
#: Drift sizes tried, in units of the scatter that white noise does not explain.
DRIFT_SIZES = (0.0, 0.35, 0.6, 0.8, 1.0, 1.3, 1.7, 2.3, 3.2)
#: Further sizes of a slow drift: most of it passes for bias and temperature, and little is left in the scatter.
HIDDEN_SIZES = (4.5, 6.5, 9.0)
#: A drift is slow where its time constant is more than this share of the longest powered run.
SLOW_SHARE = 0.05
#: Neighbouring time constants of flicker differ by about this factor: their sum is that of a continuum to some percent.
FLICKER_RATIO = 4.0
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
    tau_s: float  #: the longest, where there are several
    per_rate: float = 0.0  #: standard deviation per deg/s of table rate
    least_dps: float = 0.0  #: of a drift that was found: `MAX_EVIDENCE` is for this size or a larger one
    shortest_tau_s: float | None = None  #: flicker: equal parts with time constants from this to `tau_s`

    @cached_property
    def taus_s(self) -> tuple[float, ...]:
        """The time constants of its equal parts."""
        if self.shortest_tau_s is None:
            return (self.tau_s,)
        steps = max(1, round(math.log(self.tau_s / self.shortest_tau_s) / math.log(FLICKER_RATIO)))
        return tuple(np.geomspace(self.shortest_tau_s, self.tau_s, steps + 1).tolist())


@dataclass(frozen=True)
class Noise:
    """The noise that a fit was weighted by: its drift, and the white noise of a mean beside it, deg/s."""

    drift: Drift
    white_dps: float

    def is_close(self, other: Noise) -> bool:
        """Return whether fits that are weighted by these differ by less than a part in a million."""
        pairs = (
            (self.white_dps, other.white_dps),
            (self.drift.drift_dps, other.drift.drift_dps),
            (self.drift.per_rate, other.drift.per_rate),
        )
        return self.drift.taus_s == other.drift.taus_s and all(math.isclose(*pair, rel_tol=1e-6) for pair in pairs)

    def drift_beside(self, scatter: Scatter) -> Drift:
        """Return the drift as `solve` takes it: in units of the white noise where no readings state that."""
        if scatter.white_var is not None:
            return self.drift
        ratio = 1.0 / max(self.white_dps, 1e-300)
        return replace(self.drift, drift_dps=self.drift.drift_dps * ratio, per_rate=self.drift.per_rate * ratio)


NO_DRIFT = Noise(Drift(0.0, 1.0), 1.0)


def grid(scatter: Scatter, unexplained_dps: float, per_rate: float = 0.0) -> list[Drift]:
    """Return the drifts to average over, around the scatter that white noise leaves unexplained.

    Flicker is among them where the white noise is known: else a drift of every length would pass for what a model
    lacks, as only the residuals show the noise.
    """
    spacing, span = _times_s(scatter)
    shapes: list[tuple[float, float | None]] = [(ratio * spacing, None) for ratio in TAU_SPACINGS]
    if scatter.white_var is not None and span > FLICKER_RATIO * spacing:
        shapes.append((span, spacing))
    return [
        Drift(0.0, spacing, per_rate),
        *_points(shapes, [size for size in DRIFT_SIZES if size > 0], unexplained_dps, per_rate),
    ]


def hidden(scatter: Scatter, unexplained_dps: float, per_rate: float = 0.0) -> list[Drift]:
    """Return drifts of which the scatter between data sets shows little: slow ones, larger than it.

    A coefficient is uncertain by them too. They are no part of the noise of a data set, with which errors are compared.
    There are none where the white noise is not known.
    """
    spacing, span = _times_s(scatter)
    if scatter.white_var is None or span <= FLICKER_RATIO * spacing:
        return []
    slow = [(ratio * spacing, None) for ratio in TAU_SPACINGS if ratio * spacing > SLOW_SHARE * span]
    sizes = [size for size in DRIFT_SIZES if size > 0]
    return [
        *_points([*slow, (span, spacing)], HIDDEN_SIZES, unexplained_dps, per_rate),
        *_points([(span, None)], [*sizes, *HIDDEN_SIZES], unexplained_dps, per_rate),
    ]


def _times_s(scatter: Scatter) -> tuple[float, float]:
    """Return the median spacing of data sets, and the length of the longest powered run: a drift ends with its run."""
    in_time = np.sort(scatter.t_s)
    spacing = float(np.median(np.diff(in_time))) if len(in_time) > 1 else 1.0
    _, of_run = np.unique(scatter.run, return_inverse=True)
    first, last = np.full(of_run.max() + 1, np.inf), np.full(of_run.max() + 1, -np.inf)
    np.minimum.at(first, of_run, scatter.t_s)
    np.maximum.at(last, of_run, scatter.t_s)
    return max(spacing, 1e-3), float(np.max(last - first))


def _points(
    shapes: Sequence[tuple[float, float | None]], sizes: Sequence[float], unexplained_dps: float, per_rate: float
) -> list[Drift]:
    if unexplained_dps <= 0:
        return []
    return [
        Drift(size * unexplained_dps, tau_s, per_rate, shortest_tau_s=shortest_s)
        for tau_s, shortest_s in shapes
        for size in sizes
    ]


def log_prior(scatter: Scatter, drift: Drift, unit_dps: float = 1.0) -> float:
    """Return the log prior of a drift: log-normal about half the data sheet's figure where there is one, else flat.

    `unit_dps` is the unit of the drift: the white noise of a mean, where readings do not state it.
    """
    if scatter.datasheet_drift_dps is None:
        return 0.0
    expected = scatter.datasheet_drift_dps / 2
    size = max(drift.drift_dps * unit_dps, 0.05 * expected)
    return float(-0.5 * (np.log(size / expected) / np.log(PRIOR_FACTOR)) ** 2)
