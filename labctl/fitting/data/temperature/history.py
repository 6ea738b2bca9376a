"""History of a recording: temperature between and during data sets, powered runs, mountings, the range of the rate.

The temperature of each powered run is resampled to an even spacing of `SPACING_S`, with that of the runs before it
where the thermometer was logged on: heat flows while the unit is off. What an effect asks of it (slope, lag,
hysteresis) is computed once over the whole profile and interpolated at the times of the rows that ask.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.following import Steps, lag_shares
from labctl.recording import Recording
from labctl.recording.columns import WITHIN_S

#: Logged columns by name, (n,) each.
LoggedColumns = Mapping[str, NDArray[np.generic]]
#: What an effect asks of a temperature profile (k,) with parameters, (k,).
CourseFunction = Callable[..., Array]
#: Spacing of a resampled temperature profile, s.
SPACING_S = 10.0
#: Rows of an environment log that are no further apart are one course of the temperature, also over a power cycle, s.
MAX_GAP_S = 60.0
#: Windows whose middles are no further apart than this many of their lengths follow one another.
NEXT_WINDOW = 1.2
#: Plays of which a rounded hysteresis is made.
ROUNDED_PLAYS = 4


@dataclass(frozen=True)
class TemperatureProfile:
    """Temperature of a powered run, or of runs between which it was logged on, evenly spaced by `SPACING_S`."""

    begin_s: float  #: time of the first value, s
    temperature_c: Array  #: (k,) deg C

    def at(self, values: Array, t_s: Array) -> Array:
        """Return values of this profile (k,) interpolated linearly at times `t_s` (n,), as (n,)."""
        times = self.begin_s + SPACING_S * np.arange(len(values))
        return np.interp(t_s, times, values)


@dataclass(frozen=True, eq=False)
class TemperatureHistory:
    """History of a recording.

    Each method takes the logged columns of the rows (n,) that it answers for; they need `t_s`, and `run` where there
    is more than one. A history without profiles answers 0 for every row.
    """

    profiles: Mapping[int, TemperatureProfile] = field(default_factory=dict)  #: by number of the run
    counted: Mapping[str, tuple[int, ...]] = field(default_factory=dict)  #: "run", "mounting" -> numbers, rising
    rate_dps: float = 1.0  #: largest table rate, deg/s, without sign
    span_c: tuple[float, float] = (0.0, 1.0)  #: lowest and highest temperature, deg C
    thermometer: bool = True  #: whether anything says how warm the unit was
    middle_s: float = 0.0  #: middle of the times within a recording, s: a clock may count from 1970
    #: What was computed of the profiles, by function and its parameter: every axis asks for the same.
    _known: dict[tuple[CourseFunction, tuple[float, ...]], dict[int, Array]] = field(default_factory=dict, repr=False)

    def numbers(self, name: str) -> tuple[int, ...]:
        """Return the numbers of the runs ("run") or mountings ("mounting") of the recording, rising."""
        return self.counted.get(name, (1,))

    def rate_k_min(self, columns: LoggedColumns, over_s: float) -> Array:
        """Return the rate of change of the temperature, (n,) K/min: slope of a line over `over_s` seconds."""
        return self._evaluate(columns, _slope, over_s)

    def lag_k(self, columns: LoggedColumns, tau_s: float, cooling_tau_s: float | None = None) -> Array:
        """Return by how much a first-order follower with time constant `tau_s` lags the thermometer, (n,) K.

        Where another one is given for cooling, it holds while the follower is the warmer of the two.
        """
        if cooling_tau_s is None or cooling_tau_s == tau_s:
            return self._evaluate(columns, _lag, tau_s)
        return self._evaluate(columns, _lag_two_ways, tau_s, cooling_tau_s)

    def lags_two_ways_k(self, columns: LoggedColumns, taus_s: Array, cooling_taus_s: Array) -> NDArray[np.float64]:
        """Return the same for many pairs of time constants (p,) at once, (n, p) K."""
        t_s = np.asarray(columns["t_s"], dtype=np.float64)
        run = np.asarray(columns["run"]) if "run" in columns else np.ones(len(t_s), dtype=np.int64)
        lag_k = np.zeros((len(t_s), len(taus_s)))
        for number, profile in self.profiles.items():
            in_run = run == number
            if in_run.any():
                lags = _lags_two_ways(profile.temperature_c, taus_s, cooling_taus_s)
                lag_k[in_run] = np.column_stack([profile.at(lag, t_s[in_run]) for lag in lags.T])
        return lag_k

    def hysteresis_state(self, columns: LoggedColumns, width_k: float, *, rounded: bool = False) -> Array:
        """Return the state of a play hysteresis of width `width_k`, (n,), 1: approached from below, -1: from above.

        With `rounded` of several plays together (`rounded_plays`): it nears the new side exponentially, over `width_k`.
        """
        if not rounded:
            return self._evaluate(columns, _play, width_k)
        state = np.zeros(len(next(iter(columns.values()), ())))
        for width, share in rounded_plays(width_k):
            state += share * self._evaluate(columns, _play, width)
        return state

    def _evaluate(self, columns: LoggedColumns, function: CourseFunction, *parameters: float) -> Array:
        """Return a function of each run's temperature profile, (k,) to (k,), at the times of the rows, (n,)."""
        if not self.profiles:
            return np.zeros(len(next(iter(columns.values()), ())))
        t_s = np.asarray(columns["t_s"], dtype=np.float64)
        run = np.asarray(columns["run"]) if "run" in columns else np.ones(len(t_s), dtype=np.int64)
        cache = self._known.setdefault((function, parameters), {})
        evaluated = np.zeros(len(t_s))
        for number, profile in self.profiles.items():
            in_run = run == number
            if in_run.any():
                if number not in cache:
                    cache[number] = function(profile.temperature_c, *parameters)
                evaluated[in_run] = profile.at(cache[number], t_s[in_run])
        return evaluated


def rounded_plays(width_k: float) -> list[tuple[float, float]]:
    """Return widths, K, and shares of plays whose sum nears its new side as 1 - exp(-way / width_k).

    The distribution of widths r that does so exactly has the density r exp(-r / w) / w^2 (Prandtl and Ishlinskii's
    hysteresis); four plays are its Gauss quadrature. Unlike a state that moves with every step of the temperature, a
    play stands still in the noise of a thermometer.
    """
    k = np.arange(ROUNDED_PLAYS)  # Golub and Welsch 1969: the nodes are eigenvalues of the polynomials' recurrence
    beside = np.sqrt(k[1:] * (k[1:] + 1.0))
    nodes, vectors = np.linalg.eigh(np.diag(2.0 * k + 2.0) + np.diag(beside, 1) + np.diag(beside, -1))
    return [(float(width_k * node), float(first**2)) for node, first in zip(nodes, vectors[0], strict=True)]


def _slope(temperature_c: Array, over_s: float) -> Array:
    """Return the slope of a least-squares line over `over_s` seconds about each value, (k,) K/min."""
    half = max(round(over_s / SPACING_S / 2), 1)
    if len(temperature_c) < 3:
        return np.zeros(len(temperature_c))
    padded = np.pad(temperature_c, half, mode="edge")
    weights = np.arange(-half, half + 1, dtype=np.float64)
    weights /= (weights**2).sum() * SPACING_S / 60.0
    return np.asarray(np.convolve(padded, weights[::-1], mode="valid"), dtype=np.float64)


def _lag(temperature_c: Array, tau_s: float) -> Array:
    """Return follower minus temperature, (k,) K, in equilibrium at the start; straight lines between temperatures."""
    return Steps.even(temperature_c, SPACING_S).lagged(tau_s, 0.0)


def _lag_two_ways(temperature_c: Array, warming_s: float, cooling_s: float) -> Array:
    """Return the same of a follower with one time constant while it is the colder one, and another, (k,) K."""
    return Steps.even(temperature_c, SPACING_S).lagged_two_ways(warming_s, cooling_s, 0.0)


def _lags_two_ways(temperature_c: Array, warming_s: Array, cooling_s: Array) -> NDArray[np.float64]:
    """Return followers minus temperature for pairs of time constants (p,), (k, p) K.

    The time constant of a step is chosen by the temperature at its end and the follower at its start.
    """
    shares = np.array([[lag_shares(SPACING_S, float(tau)) for tau in taus] for taus in (warming_s, cooling_s)])
    warming, cooling = shares.transpose(0, 2, 1)
    lag_k = np.empty((len(temperature_c), len(warming_s)))
    at = np.full(len(warming_s), temperature_c[0])
    lag_k[0] = 0.0
    for k in range(1, len(temperature_c)):
        now = temperature_c[k]
        keep, last, new = np.where(now >= at, warming, cooling)
        at = keep * at + last * temperature_c[k - 1] + new * now
        lag_k[k] = at - now
    return lag_k


def _play(temperature_c: Array, width_k: float) -> Array:
    """Return temperature minus a follower with play, over half of the play, (k,): -1 to 1.

    Each temperature clips the follower to within half of the play. Clips one after the other are one clip again, so
    those up to each temperature are found by doubling their number, in as many passes as k has binary digits.
    """
    half = width_k / 2
    low, high = temperature_c - half, temperature_c + half
    low[0] = high[0] = temperature_c[0]
    reach = 1
    while reach < len(low) and np.any(low < high):
        low[reach:], high[reach:] = (
            np.minimum(np.maximum(before[:-reach], low[reach:]), high[reach:]) for before in (low, high)
        )
        reach *= 2
    return np.asarray((temperature_c - low) / half)


def history_of(recording: Recording) -> TemperatureHistory:
    """Return the history of a recording: from its environment log where there is one, else from its data sets."""
    columns = recording.columns
    environment = recording.environment
    source = environment if environment and "temperature_c" in environment and "t_s" in environment else columns
    counted = {
        name: tuple(int(number) for number in np.unique(np.asarray(columns[name])))
        for name in ("run", "mounting")
        if name in columns
    }
    rate = float(np.max(np.abs(np.asarray(columns["table_rate_dps"], dtype=np.float64)), initial=0.0)) or 1.0
    if "temperature_c" not in columns:
        return TemperatureHistory({}, counted, rate, thermometer=False, middle_s=_middle_s(columns))
    temperature_c = np.asarray(columns["temperature_c"], dtype=np.float64)
    span = (float(temperature_c.min()), float(temperature_c.max())) if len(temperature_c) else (0.0, 1.0)
    if "t_s" not in columns:
        return TemperatureHistory({}, counted, rate, span)
    return TemperatureHistory(_profiles(source, columns), counted, rate, span, middle_s=_middle_s(columns))


def _middle_s(columns: LoggedColumns) -> float:
    """Return the middle of the times within a recording, of several of the longest, s; 0 without times."""
    t_s = np.asarray(columns.get(WITHIN_S, columns.get("t_s", np.zeros(0))), dtype=np.float64)
    t_s = t_s[np.isfinite(t_s)]
    return float((t_s.min() + t_s.max()) / 2) if len(t_s) else 0.0


def _profiles(source: Mapping[str, Any], columns: Mapping[str, Any]) -> dict[int, TemperatureProfile]:
    runs = np.unique(np.asarray(columns["run"])) if "run" in columns else np.array([1])
    courses = {int(run): _course(source, int(run)) for run in runs}
    if source is columns and "duration_s" in columns:
        courses = {run: _with_ends(course, columns, run) for run, course in courses.items()}
    else:
        courses = _logged_on(courses)
    profiles: dict[int, TemperatureProfile] = {}
    for run, (times, values) in courses.items():
        if len(times) < 2:
            continue
        grid = np.arange(times[0], times[-1] + SPACING_S, SPACING_S)
        profiles[run] = TemperatureProfile(float(grid[0]), np.interp(grid, times, values))
    return profiles


def _rows_of(source: Mapping[str, Any], run: int) -> NDArray[np.int64]:
    """Return the rows of a run with a temperature, in order of time; without runs all rows are of each."""
    t_s = np.asarray(source["t_s"], dtype=np.float64)
    rows = np.isfinite(np.asarray(source["temperature_c"], dtype=np.float64))
    if "run" in source:
        rows &= np.asarray(source["run"]) == run
    found = np.flatnonzero(rows)
    return found[np.argsort(t_s[found], kind="stable")]


def _course(source: Mapping[str, Any], run: int) -> tuple[Array, Array]:
    """Return times, s, and temperatures, deg C, of a run, (k,) each."""
    rows = _rows_of(source, run)
    times, values = (np.asarray(source[name], dtype=np.float64)[rows] for name in ("t_s", "temperature_c"))
    return times, values


def _with_ends(course: tuple[Array, Array], columns: Mapping[str, Any], run: int) -> tuple[Array, Array]:
    times, values = course
    if len(times) < 2:
        return course
    return _to_the_ends(times, values, np.asarray(columns["duration_s"], dtype=np.float64)[_rows_of(columns, run)])


def _logged_on(courses: Mapping[int, tuple[Array, Array]]) -> dict[int, tuple[Array, Array]]:
    """Return the courses with those before them in front, where the log went on from the one to the next.

    A follower or a hysteresis would otherwise be taken for settled at each power-on, and its way back for a warm-up.
    """
    joined: dict[int, tuple[Array, Array]] = {}
    before: tuple[Array, Array] | None = None
    for run in sorted(courses, key=lambda run: float(courses[run][0][0]) if len(courses[run][0]) else np.inf):
        times, values = courses[run]
        if before is not None and len(times) and 0.0 < times[0] - before[0][-1] <= MAX_GAP_S:
            times, values = (np.concatenate(pair) for pair in zip(before, (times, values), strict=True))
        joined[run] = (times, values)
        before = joined[run] if len(times) else before
    return joined


def _to_the_ends(times: Array, values: Array, durations_s: Array) -> tuple[Array, Array]:
    """Return a profile of means, (k,), extended to the start of its first window and to the end of its last one.

    A follower starts at rest; on a ramp that is measured window by window it would otherwise start half a window late.
    An end is extended only where its two windows follow one another, so that they show the slope.
    """
    parts_t, parts_c = [times], [values]
    for first, second, side in ((0, 1, -1.0), (-1, -2, 1.0)):
        apart = abs(float(times[second] - times[first]))
        if 0 < apart <= NEXT_WINDOW * durations_s[first]:
            slope = float(values[second] - values[first]) / float(times[second] - times[first])
            half = side * float(durations_s[first]) / 2
            at = 0 if side < 0 else len(parts_t)
            parts_t.insert(at, np.array([times[first] + half]))
            parts_c.insert(at, np.array([values[first] + slope * half]))
    return np.concatenate(parts_t), np.concatenate(parts_c)
