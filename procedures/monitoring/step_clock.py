"""The step clock of a table by timed runs: ratio to the nominal clock, drift, and their uncertainty from the scatter.

A run of N steps at the nominal step rate f takes T = a + (N/f)(1 + x), where 1 + x is the reciprocal of the ratio and
a what ramps and replies take, equal in all runs of one session at one step rate. Least squares over all runs of a
campaign give x and its drift; the standard uncertainty is that of their scatter with its degrees of freedom (GUM 4.2,
G.3): how late replies are need not be known. A drift is applied where it differs from 0 by more than its expanded
uncertainty; one that is not applied is part of u, which contains it in full at the level of confidence.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from instruments.interfaces.table import StepClock
from procedures.contracts.journal import ClockRun

S_PER_H = 3600.0
#: Least span of the runs for a drift to be fitted, in durations of the longest run.
DRIFT_SPAN = 10.0
#: Level of confidence of an expanded uncertainty, and that at which a difference between two sessions is significant.
CONFIDENCE, CERTAIN = 0.95, 0.999
#: Largest plausible change of a crystal's frequency between two sessions of a campaign, by its temperature, ppm.
LARGEST_CHANGE_PPM = 200.0


@dataclass(frozen=True)
class ClockFit:
    """A step clock by some runs: x = `x` + `x_per_h` (t - `middle_s`), with the covariance of the two."""

    middle_s: float
    until_s: float  #: of the last run: a drift is not continued beyond it
    x: float
    x_per_h: float
    covariance: NDArray[np.float64]  #: (2, 2); zero for a drift that was not fitted
    scatter_s: float  #: standard deviation of the residuals of the runs
    has_drift: bool  #: whether a drift was fitted
    is_drift_applied: bool  #: whether it is significant; `x` is then that of the line, else that of a steady clock
    freedom: int

    def ratio(self, t_s: float) -> float:
        """Return the step rate over the nominal one at campaign time `t_s`."""
        return 1.0 / (1.0 + self.x + (self.x_per_h * self._hours(t_s) if self.is_drift_applied else 0.0))

    def u_ppm(self, t_s: float) -> float:
        """Return the standard uncertainty of the ratio at campaign time `t_s`, ppm."""
        at = np.array([1.0, self._hours(t_s)])
        left_out = 0.0 if self.is_drift_applied else self.x_per_h * self._hours(t_s) / coverage_factor(self.freedom)
        return 1e6 * self.ratio(t_s) ** 2 * math.sqrt(max(float(at @ self.covariance @ at), 0.0) + left_out**2)

    def expanded_ppm(self, t_s: float) -> float:
        """Return the expanded uncertainty at a level of confidence of 95 %, ppm."""
        return coverage_factor(self.freedom) * self.u_ppm(t_s)

    def _hours(self, t_s: float) -> float:
        return (min(t_s, self.until_s) - self.middle_s) / S_PER_H

    @property
    def drift_ppm_per_h(self) -> float:
        """Drift of the ratio."""
        return -1e6 * self.x_per_h * self.ratio(self.middle_s) ** 2

    @property
    def drift_u_ppm_per_h(self) -> float:
        """Standard uncertainty of the drift."""
        return 1e6 * self.ratio(self.middle_s) ** 2 * math.sqrt(max(float(self.covariance[1, 1]), 0.0))


@dataclass(frozen=True)
class MeasuredClock:
    """The step clock of a campaign as it is known so far."""

    nominal: StepClock
    fit: ClockFit
    ratio: float  #: at the last run
    u_ppm: float  #: standard uncertainty of rates over the time of the runs, root mean square
    runs: int

    @property
    def deviation_ppm(self) -> float:
        """Deviation of the step rate from the nominal one at the last run."""
        return 1e6 * (self.ratio - 1.0)

    @property
    def expanded_ppm(self) -> float:
        """Expanded uncertainty at a level of confidence of 95 %, ppm."""
        return coverage_factor(self.fit.freedom) * self.u_ppm

    @property
    def deviation_expanded_ppm(self) -> float:
        """Expanded uncertainty of the deviation at the last run, ppm: there a drift counts more than on average."""
        return self.fit.expanded_ppm(self.fit.until_s)

    @property
    def limit_ppm(self) -> float:
        """Largest deviation from the nominal clock within the expanded uncertainties of both, ppm."""
        return math.hypot(self.deviation_expanded_ppm, 3.0 * self.nominal.u_ppm)


def coverage_factor(freedom: int, confidence: float = CONFIDENCE) -> float:
    """Return the factor of an expanded uncertainty, at 95 % by default (GUM G.3.2, Student's t)."""
    from scipy.special import stdtrit  # noqa: PLC0415  half of the start of a process that times no run

    return float(stdtrit(freedom, 0.5 + confidence / 2))


def fitted(runs: Sequence[ClockRun]) -> ClockFit | None:
    """Return the step clock fitted to runs; None for too few runs to estimate their scatter."""
    t_s = np.array([run.t_s for run in runs])
    nominal_s = np.array([run.nominal_s for run in runs])
    late_s = np.array([run.duration_s for run in runs]) - nominal_s
    if not len(runs):
        return None
    middle_s = float(np.average(t_s, weights=nominal_s))
    spans = bool(np.ptp(t_s) > DRIFT_SPAN * nominal_s.max())
    rates = [nominal_s, nominal_s * (t_s - middle_s) / S_PER_H] if spans else [nominal_s]
    matrix: NDArray[np.float64] = np.stack([*rates, *_offsets(runs)], axis=1)
    terms, freedom = len(rates), len(runs) - matrix.shape[1]
    if freedom < 1 or np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        return None
    values, *_ = np.linalg.lstsq(matrix, late_s, rcond=None)
    scatter_s = math.sqrt(float(np.sum((late_s - matrix @ values) ** 2)) / freedom)
    covariance = np.zeros((2, 2))
    covariance[:terms, :terms] = (scatter_s**2 * np.linalg.inv(matrix.T @ matrix))[:terms, :terms]
    x, x_per_h = float(values[0]), float(values[1]) if spans else 0.0
    is_applied = spans and abs(x_per_h) > coverage_factor(freedom) * math.sqrt(float(covariance[1, 1]))
    if spans and not is_applied:
        x = float(np.linalg.lstsq(np.delete(matrix, 1, axis=1), late_s, rcond=None)[0][0])
    return ClockFit(
        middle_s, float(t_s.max()), x, x_per_h, covariance, scatter_s, spans, is_applied, freedom
    )  # fmt: skip


def _offsets(runs: Sequence[ClockRun]) -> list[NDArray[np.float64]]:
    """Return a column for what ramps and replies take in each session at each step rate."""
    groups = [(run.session, run.step_hz) for run in runs]
    return [np.array([float(group == one) for group in groups]) for one in dict.fromkeys(groups)]


def measured(runs: Sequence[ClockRun], nominal: StepClock) -> MeasuredClock | None:
    """Return the step clock of a campaign by all its runs so far; None for too few."""
    fit = fitted(runs)
    if fit is None:
        return None
    ratio = fit.ratio(fit.until_s)
    return MeasuredClock(nominal, fit, ratio, _mean_u_ppm(fit, runs), len(runs))


def _mean_u_ppm(fit: ClockFit, runs: Sequence[ClockRun]) -> float:
    """Return the standard uncertainty of the fit over the time of its runs, root mean square, ppm."""
    return float(np.sqrt(np.mean([fit.u_ppm(run.t_s) ** 2 for run in runs])))


def change_ppm(runs: Sequence[ClockRun], session: int) -> tuple[float, float] | None:
    """Return by how much a session's clock differs from that of the sessions before, and what chance explains, ppm.

    None where one of the two has too few runs.
    """
    before, now = (fitted([run for run in runs if (run.session < session) is earlier]) for earlier in (True, False))
    if before is None or now is None:
        return None
    change = 1e6 * (now.ratio(now.middle_s) - before.ratio(before.middle_s))
    u_ppm = math.hypot(now.u_ppm(now.middle_s), before.u_ppm(before.middle_s))
    freedom = min(now.freedom, before.freedom)
    return change, u_ppm * coverage_factor(freedom, CERTAIN)
