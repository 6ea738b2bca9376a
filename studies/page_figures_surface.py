"""The drift of data-set means beside a flexible surface, as a noise floor has it: NumPy only, nothing of labctl.

`docs/explanation/fitting.md` states surface and drift under *Error figures*, in numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from studies.page_figures_recomputed import Sets
from studies.page_figures_refit import (
    SAME_TEMPERATURE_C,
    Drift,
    Means,
    drift_of,
    map_cells,
    over_drifts,
    temperature_levels,
)

Array = np.ndarray
#: Columns, over the number of data sets; the same with levels of the temperature; and by how many there are fewer.
SHARE, SHARE_WITH_LEVELS, FREE = 0.5, 0.7, 8
#: Highest power of the temperature beside each power of the rate, from 0 on.
DEGREES = (6, 4, 2, 2)
#: A column of which those before leave less is left out; time constants of a warm-up, s.
NEW, WARM_UPS_S = 1e-2, (600.0, 3600.0)
#: With fewer data sets the drift is that of a data sheet; the chance at which an F-test asks for levels.
LEAST_SETS, F_CHANCE = 16, 1e-4
#: A step of the temperature over half of its range, below which it has no direction.
STEP = 1e-3
#: Time constants of lags, s, and widths of hystereses, K; spacing of the temperature course, s, and its largest gap, s.
LAGS_S, WIDTHS_K, SPACING_S, LARGEST_GAP_S = (150.0, 400.0, 1000.0, 2500.0), (2.0, 6.0, 15.0), 10.0, 60.0
#: A table measures on ramps where half of the data sets have at least this rate of change, K/min, over so long, s.
RAMP_K_MIN, RAMP_S = 0.1, 300.0
#: Columns of a recording that are in the surface in another form, or cause no error.
OTHERWISE = {"t_s", "table_rate_dps", "table_angle_deg", "dataset", "run", "mounting", "valid", "temperature_c",
             "power_s", "since_begin_s", "duration_s", "n"}  # fmt: skip


class Course:
    """The temperature of a unit over all its powered runs, which was logged without a gap, evenly spaced."""

    def __init__(self, t_s: Array, temperature_c: Array) -> None:
        assert np.diff(t_s).max() <= LARGEST_GAP_S, "a log with a gap: courses of single runs are not written here"
        self._t_s = np.arange(t_s[0], t_s[-1] + SPACING_S, SPACING_S)
        self._warm = np.interp(self._t_s, t_s, temperature_c)

    def change_k_min(self, t_s: Array) -> Array:
        """Return the slope of a straight line over so long about each time."""
        half = round(RAMP_S / SPACING_S / 2)
        at = np.arange(-half, half + 1.0)
        padded = np.concatenate([np.repeat(self._warm[0], half), self._warm, np.repeat(self._warm[-1], half)])
        slope = np.array([at @ padded[k : k + len(at)] for k in range(len(self._warm))]) / (at @ at)
        return np.interp(t_s, self._t_s, slope * 60 / SPACING_S)

    def lag_k(self, tau_s: float, t_s: Array) -> Array:
        """Return a follower of first order less the temperature, which goes on a straight line from step to step."""
        keep, ratio = math.exp(-SPACING_S / tau_s), SPACING_S / tau_s
        lag = np.zeros(len(self._warm))
        for k, fall in enumerate(-np.diff(self._warm), start=1):
            lag[k] = keep * lag[k - 1] + (1 - keep) / ratio * fall
        return np.interp(t_s, self._t_s, lag)

    def play(self, width_k: float, t_s: Array) -> Array:
        """Return where the temperature is in a play of this width, -1 to 1; it begins in the middle."""
        state, follower = np.zeros(len(self._warm)), self._warm[0]
        for k, warm in enumerate(self._warm):
            follower = min(max(follower, warm - width_k / 2), warm + width_k / 2)
            state[k] = (warm - follower) / (width_k / 2)
        return np.interp(t_s, self._t_s, state)


def drift_of_floor(sets: Sets, axis: str, means: Means, course: Course) -> Drift:
    """Return the drift in the noise floor of an output: by the data sheet of few data sets, else beside the surface."""
    if len(sets.number) < LEAST_SETS and means.stability_dps is not None:
        return Drift(means.stability_dps, (math.inf,))
    rate, errors = sets.own_rate_dps[axis], sets.output_dps[axis] - sets.own_rate_dps[axis]
    plain = surface(sets, axis, course)
    fits = over_drifts(plain, errors, means, only_shown=True)
    fuller = _orthonormal(_temperatures(sets.temperature_c, _over_largest(rate)), plain, SHARE_WITH_LEVELS)
    if fuller.shape[1] > plain.shape[1] and _asked_for(plain, fuller, errors, means, drift_of(fits)):
        fits = over_drifts(fuller, errors, means, only_shown=True)
    return drift_of(fits)


def surface(sets: Sets, axis: str, course: Course | None) -> Array:
    """Return the orthonormal columns of the surface, (n, k), the most important first; no course: without times."""
    return _orthonormal(_blocks(sets, axis, course), np.zeros((len(sets.number), 0)), SHARE)


def near_repeats(left: list[Array], sets: Sets) -> float:
    """Return the standard deviation of one data set by neighbours of nearly equal rate and temperature."""
    same = 1e-3 * np.abs(sets.table_rate_dps).max()
    order = np.lexsort((sets.temperature_c, np.round(sets.table_rate_dps / same)))
    near = np.abs(np.diff(sets.table_rate_dps[order])) <= same
    near &= np.abs(np.diff(sets.temperature_c[order])) <= SAME_TEMPERATURE_C
    near &= sets.position[order][1:] == sets.position[order][:-1]
    return float(np.sqrt(np.mean([np.diff(each[order])[near] ** 2 for each in left]) / 2))


def _orthonormal(columns: Iterator[Array], begin: Array, share: float) -> Array:
    """Return columns (n, k) orthonormal to those before, as many as there may be."""
    basis, most = begin, min(int(share * len(begin)), len(begin) - FREE)
    while basis.shape[1] < most and (column := next(columns, None)) is not None:
        size = np.linalg.norm(column)
        left = column / size if size else column
        for _ in range(2):
            left = left - basis @ (basis.T @ left)
        new = np.linalg.norm(left)
        if new > NEW:
            basis = np.column_stack([basis, left / new])
    return basis


def _blocks(sets: Sets, axis: str, course: Course | None) -> Iterator[Array]:
    """Yield one column after the other."""
    rate, warm = _over_largest(sets.own_rate_dps[axis]), _chebyshev(sets.temperature_c)
    places = [(sets.position == up).astype(float) for up in np.unique(sets.position)]
    yield from places
    yield from (rate**power for power in (1, 2, 3))
    for other in range(3):
        if "xyz"[other] != axis:
            yield from (_over_largest(sets.rate_dps[:, other]) * warm[n] for n in range(3))
    for n in range(1, DEGREES[0] + 1):
        yield from (warm[n] * rate**power for power, most in enumerate(DEGREES) if n <= most)
    column = map_cells(sets.table_rate_dps, sets.temperature_c, sets.position)[0]
    names = np.char.add(sets.position.astype(str), column.astype(str))
    yield from (np.array(names == name, dtype=float) for name in np.unique(names))
    if course is not None:
        yield from _history(sets, course, warm, rate)
    yield from _surroundings(sets, rate)
    yield from (place * rate**power for place in places for power in (1, 2, 3))
    yield from (place * warm[n] for place in places for n in (1, 2, 3))


def _history(sets: Sets, course: Course, warm: list[Array], rate: Array) -> Iterator[Array]:
    """Yield the direction in which the temperature went, lags and hystereses, functions of the time since power-on."""
    t_s = sets.t_s
    assert t_s is not None
    order = np.argsort(t_s, kind="stable")
    steps = np.diff(warm[1][order], prepend=warm[1][order[0]])
    sign = np.where(np.abs(steps) > STEP, np.sign(steps), 0.0)
    known = np.flatnonzero(sign)
    if len(known):  # where it does not change, the direction is that before; at the start the first
        sign = sign[known[np.maximum(np.searchsorted(known, np.arange(len(sign)), side="right") - 1, 0)]]
    direction = np.empty(len(sign))
    direction[order] = sign
    if np.ptp(direction):
        yield from (direction * each for each in (1.0, warm[1], warm[2], rate))
    if not np.any(rate) or np.median(np.abs(course.change_k_min(t_s))) >= RAMP_K_MIN:
        lags = [course.lag_k(tau_s, t_s) for tau_s in LAGS_S]
        yield from lags
        yield from (course.play(width_k, t_s) for width_k in WIDTHS_K)
        yield from (lag * rate for lag in lags)
    since = np.maximum(sets.mean.get("power_s", t_s - t_s.min()), 0.0)
    for factor in (1.0, rate):
        yield from (np.exp(-since / tau_s) * factor for tau_s in WARM_UPS_S)


def _surroundings(sets: Sets, rate: Array) -> Iterator[Array]:
    """Yield every other logged number, alone and times the rate."""
    names = {*sets.mean, "previous_rate_dps"} - OTHERWISE
    for name in sorted(each for each in names if not each.startswith("gyro_")):
        logged = sets.mean.get(name, np.concatenate([[0.0], sets.table_rate_dps[:-1]]))
        around = _between(logged)
        yield from (around, around * rate)


def _temperatures(temperature_c: Array, rate: Array) -> Iterator[Array]:
    """Yield a bias, a scale factor and their slopes at every discrete temperature."""
    level = temperature_levels(temperature_c)
    if level is None:
        return
    at = [level == k for k in range(level.max() + 1)]
    within = temperature_c - (np.bincount(level, temperature_c) / np.bincount(level))[level]
    for factor in (1.0, rate, within, within * rate):
        yield from (each * factor for each in at)


def _asked_for(plain: Array, fuller: Array, errors: Array, means: Means, drift: Drift) -> bool:
    """Return whether an F-test at a drift asks for the further columns of a surface."""
    modes = means.modes(drift.taus_s, drift.per_rate)
    weight = 1 / np.sqrt(1 + drift.size_dps**2 * modes.drift_var)
    chi2 = []
    for columns in (plain, fuller):
        rows, values = (weight[:, None] * (modes.directions @ each) for each in (columns, errors[:, None]))
        chi2.append(float(np.sum((values - rows @ np.linalg.lstsq(rows, values, rcond=None)[0]) ** 2)))
    more, free = fuller.shape[1] - plain.shape[1], len(errors) - fuller.shape[1]
    return f_above((chi2[0] - chi2[1]) / more / (chi2[1] / free), more, free) <= F_CHANCE


def f_above(ratio: float, above: int, below: int) -> float:
    """Return the chance that an F-distributed ratio is larger: Simpson's rule on the beta density, in s = sqrt(x)."""
    a, b = below / 2, above / 2
    s = np.linspace(0.0, math.sqrt(below / (below + above * ratio)), 20_001)
    # with x = s^2 and 1 - x = (1 - s)(1 + s) the density is 2 s^(2a - 1) (1 - x)^(b - 1) / B(a, b)
    density = np.zeros(len(s))
    inner = s[1:-1] if s[-1] == 1.0 else s[1:]
    logs = (2 * a - 1) * np.log(inner) + (b - 1) * np.log1p(-(inner**2))
    density[1 : 1 + len(inner)] = 2 * np.exp(logs + math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b))
    weights = np.full(len(s), 2.0)
    weights[1::2], weights[0], weights[-1] = 4.0, 1.0, 1.0
    return float(weights @ density * (s[1] - s[0]) / 3)


def _over_largest(values: Array) -> Array:
    largest = np.abs(values).max()
    return values / largest if largest else values


def _between(values: Array) -> Array:
    half = np.ptp(values) / 2
    return (values - values.min()) / half - 1 if half else 0.0 * values


def _chebyshev(temperature_c: Array) -> list[Array]:
    """Return the Chebyshev polynomials of the temperature over its range, by their recurrence."""
    x = _between(temperature_c)
    each = [np.ones(len(x)), x]
    while len(each) <= DEGREES[0]:
        each.append(2 * x * each[-1] - each[-2])
    return each
