"""A fit of bias, scale factor and misalignment by its documentation: NumPy only, nothing of labctl.

The drift of the means is averaged over the grid that `docs/explanation/fitting.md` states under *Weights*.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from studies.page_figures_formulas import Law, waves
from studies.page_figures_recomputed import Sets

Array = np.ndarray
#: Temperatures within this span are one; levels are discrete where a gap is this many times the next smaller one.
ONE_TEMPERATURE_C, GAP_RATIO, LEAST_GAP_C, BINS = 1.0, 3.0, 1e-3, 8
#: Rates of one column of a map: within this share, or this rate. Temperatures of one cell, deg C.
SAME_RATE, LEAST_RATE_DPS, SAME_TEMPERATURE_C = 1e-3, 1e-3, 0.25
#: The grid of drifts: sizes over the unexplained scatter, of slow ones these too; time constants over the spacing.
SIZES, HIDDEN_SIZES = (0.35, 0.6, 0.8, 1.0, 1.3, 1.7, 2.3, 3.2), (4.5, 6.5, 9.0)
SPACINGS, SLOW, FLICKER_RATIO = (0.25, 3.0, 12.0, 50.0, 200.0), 0.05, 4.0
#: Width of the prior of a size, a factor; largest drift over half the bias stability; that where none is stated, deg/s.
PRIOR_FACTOR, LARGEST, USUAL_DPS = 2.5, 12.0, 0.004
#: Groups of rates that are left out in turn.
RATE_GROUPS = 11
#: What noise that grows with the rate has to gain in log likelihood.
GROWTH_GAIN = 3.0


def temperature_levels(temperature_c: Array) -> Array | None:
    """Return the number of the discrete temperature of each data set, (n,) rising; None: the temperatures run on."""
    order = np.argsort(temperature_c, kind="stable")
    n, gaps = len(order), np.diff(temperature_c[order])
    if np.ptp(temperature_c) <= ONE_TEMPERATURE_C:
        return np.zeros(n, dtype=int)
    ranked = np.sort(gaps)[::-1]
    most = min(n - 2, n // 2)
    ratio = ranked[:most] / np.maximum(ranked[1 : most + 1], LEAST_GAP_C)
    if ratio.max() < GAP_RATIO:
        return None
    level = np.empty(n, dtype=int)
    level[order] = np.concatenate([[0], np.cumsum(gaps >= ranked[np.argmax(ratio)])])
    own = [temperature_c[level == k] for k in range(level.max() + 1)]
    nearest = np.diff([each.mean() for each in own]).min()
    return level if max(np.ptp(each) for each in own) < nearest / 2 else None


def parts_left_out(temperature_c: Array) -> list[Array]:
    """Return which data sets are left out together, (n,) each: those of one temperature or of one bin."""
    level = temperature_levels(temperature_c)
    if level is None:
        level = np.argsort(np.argsort(temperature_c, kind="stable"), kind="stable") * BINS // len(temperature_c)
    return [level == k for k in range(level.max() + 1)]


def map_cells(table_rate_dps: Array, temperature_c: Array, position: Array) -> tuple[Array, Array]:
    """Return column and row, (n,) each, of the data sets in the map of rate and temperature."""
    column = _runs(table_rate_dps, lambda first: max(SAME_RATE * abs(first), LEAST_RATE_DPS))
    row = temperature_levels(temperature_c)
    if row is not None:
        cells = np.unique([np.unique(position, return_inverse=True)[1], column, row], axis=1, return_inverse=True)[1]
        cells = cells.ravel()
        if max(np.ptp(temperature_c[cells == k]) for k in range(cells.max() + 1)) <= SAME_TEMPERATURE_C:
            return column, row
    return column, _runs(temperature_c, lambda _: SAME_TEMPERATURE_C)


def _runs(values: Array, width: Callable[[float], float]) -> Array:
    """Return the number of the span that each value is in, (n,) rising; a span begins at its lowest value."""
    number, first, found = -1, -np.inf, np.empty(len(values), dtype=int)
    for k in np.argsort(values, kind="stable").tolist():
        if number < 0 or values[k] - first > width(first):
            number, first = number + 1, values[k]
        found[k] = number
    return found


@dataclass(frozen=True)
class Drift:
    """Size, time constants of equal parts, and noise for each deg/s of the table."""

    size_dps: float
    taus_s: tuple[float, ...]
    per_rate: float = 0.0
    is_shown: bool = True  #: whether the scatter between data sets would show it


class Modes(NamedTuple):
    """Directions (n, n) in which white noise has the variance 1 and a drift of 1 deg/s that of each mode (n,)."""

    directions: Array
    drift_var: Array
    log_white: float  #: log determinant of the white noise


@dataclass(frozen=True)
class Means:
    """What is known of the means of the data sets, (n,) each, and of the once-per-turn columns of an output."""

    t_s: Array
    run: Array
    rate_dps: Array
    white_var: Array | None  #: None: the readings are not known
    stability_dps: float | None  #: by the data sheet
    turning_var: float = 0.0  #: of each amplitude of the once-per-turn columns, which are the last

    def of(self, rows: Array) -> Means:
        """Return some of the data sets."""
        white = None if self.white_var is None else self.white_var[rows]
        return replace(self, t_s=self.t_s[rows], run=self.run[rows], rate_dps=self.rate_dps[rows], white_var=white)

    def modes(self, taus_s: tuple[float, ...], per_rate: float) -> Modes:
        """Return the directions of the means in which white noise and a drift of these time constants are separate."""
        own = np.ones(len(self.t_s)) if self.white_var is None else self.white_var
        own = own + (per_rate * self.rate_dps) ** 2
        together = self._same_run * np.mean([np.exp(-self._distance / tau) for tau in taus_s], axis=0)
        variance, directions = np.linalg.eigh(together / np.sqrt(np.outer(own, own)))
        return Modes(directions.T / np.sqrt(own), np.maximum(variance, 0.0), float(np.log(own).sum()))

    @cached_property
    def _distance(self) -> Array:
        return np.abs(self.t_s[:, None] - self.t_s)

    @cached_property
    def _same_run(self) -> Array:
        return self.run[:, None] == self.run

    def grid(self, unexplained_dps: float, per_rate: float) -> list[Drift]:
        """Return the drifts that are averaged over."""
        spacing = float(np.median(np.diff(np.sort(self.t_s))))
        longest = float((self._distance * self._same_run).max())
        times: list[tuple[float, ...]] = [(ratio * spacing,) for ratio in SPACINGS]
        shown = list(itertools.product(times, SIZES))
        hidden: list[tuple[tuple[float, ...], float]] = []
        if self.white_var is not None and longest > FLICKER_RATIO * spacing:
            steps = max(1, round(np.log(longest / spacing) / np.log(FLICKER_RATIO)))
            flicker = tuple(np.geomspace(spacing, longest, steps + 1).tolist())
            slow = [tau for tau in times if tau[0] > SLOW * longest]
            shown += itertools.product([flicker], SIZES)
            hidden += itertools.product([*slow, flicker], HIDDEN_SIZES)
            hidden += itertools.product([(longest,)], [*SIZES, *HIDDEN_SIZES])
        points = [(0.0, (spacing,), True), *((size, tau, True) for tau, size in shown),
                  *((size, tau, False) for tau, size in hidden)]  # fmt: skip
        return [Drift(size * unexplained_dps, tau, per_rate, is_shown) for size, tau, is_shown in points]

    def log_prior(self, drift: Drift) -> float:
        """Return the log of the prior of a size: log-normal about half the bias stability of the data sheet."""
        if self.stability_dps is None:
            return 0.0
        half = self.stability_dps / 2
        return float(-0.5 * (np.log(max(drift.size_dps, 0.05 * half) / half) / np.log(PRIOR_FACTOR)) ** 2)


@dataclass(frozen=True)
class Fit:
    """One weighted fit: coefficients (k,), covariance (k, k), log likelihood, what it leaves (n,) and the drift."""

    values: Array
    covariance: Array
    log_likelihood: float
    left: Array
    drift: Drift
    scale: float  #: chi2 over the degrees of freedom; 1 at least where the white noise is known


def weighted(columns: Array, values: Array, means: Means, drift: Drift, modes: Modes | None = None) -> Fit:
    """Fit columns (n, k) to values (n,) by generalised least squares at one drift, with the restricted likelihood."""
    modes = modes or means.modes(drift.taus_s, drift.per_rate)
    total = 1.0 + drift.size_dps**2 * modes.drift_var
    size = np.linalg.norm(columns, axis=0)
    rows = modes.directions @ np.column_stack([columns / size, values]) / np.sqrt(total)[:, None]
    # a once-per-turn amplitude is 0 with its known variance: one more row, in which there is no drift
    turning = _turning(columns, means)
    known = np.zeros((len(turning), rows.shape[1]))
    known[np.arange(len(turning)), turning] = 1 / (size[turning] * np.sqrt(means.turning_var)) if len(turning) else 0.0
    rows = np.vstack([rows, known])
    q, r = np.linalg.qr(rows[:, :-1])
    beta = np.linalg.solve(r, q.T @ rows[:, -1])
    chi2 = float(np.sum((rows[:, -1] - rows[:, :-1] @ beta) ** 2))
    freedom = len(rows) - len(beta)
    is_known = means.white_var is not None
    logs = modes.log_white + np.log(total).sum() + 2 * np.log(np.abs(np.diag(r))).sum()
    likelihood = means.log_prior(drift) - 0.5 * (logs + (chi2 if is_known else freedom * np.log(chi2)))
    scale = max(chi2 / freedom, 1.0) if is_known else chi2 / freedom
    inverse, found = np.linalg.inv(r), beta / size
    covariance = scale * (inverse @ inverse.T) / np.outer(size, size)
    return Fit(found, covariance, float(likelihood), values - columns @ found, drift, scale)


def _turning(columns: Array, means: Means) -> Array:
    """Return which columns are once-per-turn ones of known size: a cosine and a sine in two positions, the last."""
    return np.arange(columns.shape[1] - 4, columns.shape[1]) if means.turning_var else np.arange(0)


def over_drifts(columns: Array, values: Array, means: Means, *, only_shown: bool = False) -> list[Fit]:
    """Return the fit at each drift of the grid; with noise that grows with the rate where it is clearly likelier.

    `only_shown` is without the slow drifts that the scatter between data sets does not show, as of a noise floor.
    """
    unexplained = _unexplained_dps(weighted(columns, values, means, Drift(0.0, (1.0,))), columns, values, means)

    def at(per_rate: float) -> list[Fit]:
        drifts = [each for each in means.grid(unexplained, per_rate) if each.is_shown or not only_shown]
        modes = {taus: means.modes(taus, per_rate) for taus in {drift.taus_s for drift in drifts}}
        return [weighted(columns, values, means, drift, modes[drift.taus_s]) for drift in drifts]

    fits = at(0.0)
    best = max(fits, key=lambda fit: fit.log_likelihood)
    growing = _per_rate(best, means)
    if growing > 0:
        more = at(growing)
        if max(fit.log_likelihood for fit in more) > best.log_likelihood + GROWTH_GAIN:
            return more
    return fits


def _unexplained_dps(first: Fit, columns: Array, values: Array, means: Means) -> float:
    turning = _turning(columns, means)
    freedom = len(values) + len(turning) - columns.shape[1]
    largest = LARGEST * (means.stability_dps or USUAL_DPS) / 2 / max(SIZES)
    if means.white_var is None:
        return float(min(1.0, largest / np.sqrt(first.left @ first.left / freedom)))
    # what states the size of a once-per-turn amplitude counts as a data set, but shows no scatter of data sets
    left = np.concatenate([first.left, first.values[turning]])
    variance = np.concatenate([means.white_var, np.full(len(turning), means.turning_var)])
    excess = np.sum(left**2 / variance) / freedom - 1
    return float(min(np.sqrt(max(excess, 0.01) / np.mean(1 / means.white_var)), largest))


def _per_rate(best: Fit, means: Means) -> float:
    rate, left = np.abs(means.rate_dps), np.abs(best.left)
    fast, slow = rate > np.quantile(rate, 2 / 3), rate < np.quantile(rate, 1 / 3)
    if fast.sum() < 8 or slow.sum() < 8:
        return 0.0
    high, low = 1.4826 * np.median(left[fast]), 1.4826 * np.median(left[slow])
    found = np.sqrt(max(high**2 - low**2, 0.0)) / np.median(rate[fast])
    return float(found if means.white_var is not None else found / np.sqrt(best.scale))


def averaged(fits: Sequence[Fit]) -> tuple[Array, Array]:
    """Return coefficients (k,) and their covariance (k, k): within the fits and between them, by their likelihood."""
    share = shares(fits)
    values = share @ np.array([fit.values for fit in fits])
    spread = [s * (fit.covariance + np.outer(fit.values - values, fit.values - values))
              for s, fit in zip(share, fits, strict=True)]  # fmt: skip
    return values, np.sum(spread, axis=0)


def shares(fits: Sequence[Fit]) -> Array:
    """Return the share of each fit in the likelihood, (d,)."""
    logs = np.array([fit.log_likelihood for fit in fits])
    likelihood = np.exp(logs - logs.max())
    return likelihood / likelihood.sum()


def drift_of(fits: Sequence[Fit]) -> Drift:
    """Return the likeliest drift that the scatter shows, of the size that is averaged over them."""
    shown = [fit for fit in fits if fit.drift.is_shown]
    best, share = max(shown, key=lambda fit: fit.log_likelihood), shares(shown)
    sizes = np.array([np.sqrt(fit.scale) * fit.drift.size_dps for fit in shown])
    return Drift(float(np.sqrt(share @ sizes**2)), best.drift.taus_s, best.drift.per_rate * float(np.sqrt(best.scale)))


def weighting_drift(fits: Sequence[Fit], means: Means) -> Drift:
    """Return the same as a fit to a part takes it: beside white noise as it is stated, else in units of that noise."""
    shown = [fit for fit in fits if fit.drift.is_shown]
    best, share = max(shown, key=lambda fit: fit.log_likelihood), shares(shown)
    scales = np.array([fit.scale for fit in shown]) if means.white_var is None else np.ones(len(shown))
    white_dps = 1.0 if means.white_var is not None else np.sqrt(best.scale)
    sizes = np.array([fit.drift.size_dps for fit in shown])
    return Drift(float(np.sqrt(share @ (scales * sizes**2)) / white_dps), best.drift.taus_s, best.drift.per_rate)


@dataclass(frozen=True)
class Refit:
    """A fit of the law of a version to the data sets, axis by axis; its columns: the coefficients, then the waves."""

    law: Law
    sets: Sets
    means: Mapping[str, Means]
    columns: Mapping[str, Array]  #: axis -> (n, k)
    errors_dps: Mapping[str, Array]  #: axis -> (n,) output less true rate

    @staticmethod
    def of(law: Law, sets: Sets, means: Mapping[str, Means]) -> Refit:
        """Build the columns of each axis."""
        columns = {}
        for axis in law.axes:
            own = law.columns(axis, np.column_stack([sets.own_rate_dps[each] for each in law.axes]), sets.temperature_c)
            each = waves(sets.table_angle_rad, sets.turned_rad, sets.position, axis) if means[axis].turning_var else []
            columns[axis] = np.column_stack([own, *each])
        errors = {axis: sets.output_dps[axis] - sets.own_rate_dps[axis] for axis in law.axes}
        return Refit(law, sets, means, columns, errors)

    @cached_property
    def fits(self) -> dict[str, list[Fit]]:
        """The fit at each drift, by axis."""
        return {axis: over_drifts(own, self.errors_dps[axis], self.means[axis]) for axis, own in self.columns.items()}

    @cached_property
    def averaged(self) -> dict[str, tuple[Array, Array]]:
        """Coefficients (k,) and covariance (k, k), by axis."""
        return {axis: averaged(fits) for axis, fits in self.fits.items()}

    @property
    def left_dps(self) -> dict[str, Array]:
        """What the fit leaves of the outputs, axis -> (n,)."""
        return {axis: self.errors_dps[axis] - self.columns[axis] @ self.averaged[axis][0] for axis in self.law.axes}

    @cached_property
    def inside_dps(self) -> Array:
        """Corrected less true rates of the fit itself, (n, axes)."""
        return self._error_dps({axis: values for axis, (values, _) in self.averaged.items()})

    @cached_property
    def outside_temperature_dps(self) -> Array | None:
        """The same of each data set by a fit without its temperature; None where what is left is not enough."""
        parts = parts_left_out(self.sets.temperature_c)
        return self._outside(parts) if len(parts) - 1 > self.law.temperature_degree else None

    @cached_property
    def outside_rate_dps(self) -> Array:
        """The same without its rate: at most eleven groups of neighbouring rates are left out in turn."""
        rates = np.round(self.sets.table_rate_dps, 3)
        levels = np.unique(rates)
        groups = np.array_split(levels, min(len(levels), RATE_GROUPS))
        return self._outside([np.isin(rates, group) for group in groups])

    def rms_left_out(self) -> float | None:
        """Return the RMS error at temperatures left out in turn, deg/s; None where what is left is not enough."""
        outside = self.outside_temperature_dps
        return None if outside is None else float(np.sqrt(np.mean(outside**2)))

    def _outside(self, parts: Sequence[Array]) -> Array:
        """Return the errors of the data sets of each part by a fit to the others, at the drift of the fit to all."""
        outside = np.empty((len(self.sets.number), len(self.law.axes)))
        for part in parts:
            found = {}
            for axis, fits in self.fits.items():
                columns = self.columns[axis][~part]
                means, values = self.means[axis].of(~part), self.errors_dps[axis][~part]
                found[axis] = weighted(columns, values, means, weighting_drift(fits, means)).values
            outside[part] = self._error_dps(found)[part]
        return outside

    def _error_dps(self, found: Mapping[str, Array]) -> Array:
        """Return corrected less true rates, (n, axes), by coefficients; the waves are taken off the outputs first."""
        names, axes = self.law.names, self.law.axes
        coefficients = {axis: dict(zip(names[axis], found[axis], strict=False)) for axis in axes}
        waves_dps = {axis: self.columns[axis][:, len(names[axis]) :] @ found[axis][len(names[axis]) :] for axis in axes}
        output = np.column_stack([self.sets.output_dps[axis] - waves_dps[axis] for axis in axes])
        true = np.column_stack([self.sets.own_rate_dps[axis] for axis in axes])
        return replace(self.law, coefficients=coefficients).corrected(output, self.sets.temperature_c) - true
