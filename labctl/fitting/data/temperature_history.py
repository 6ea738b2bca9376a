"""What was before a reading: temperatures between and during data sets, their direction, runs and mountings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_banded

from labctl.recording import Recording

if TYPE_CHECKING:
    from labctl.fitting.data.channels import Channels

Array = NDArray[np.float64]
#: The temperature's course is brought to this spacing.
SPACING_S = 10.0


@dataclass(frozen=True)
class TemperatureCourse:
    """The temperature of one powered run, evenly spaced."""

    begin_s: float
    temperature_c: Array

    def at(self, values: Array, t_s: Array) -> Array:
        """Return values of this course, (k,), at times (n,)."""
        times = self.begin_s + SPACING_S * np.arange(len(values))
        return np.interp(t_s, times, values)


@dataclass(frozen=True, eq=False)
class TemperatureHistory:
    """The history of a recording; every question is asked for the rows of some channels."""

    courses: Mapping[int, TemperatureCourse] = field(default_factory=dict)  #: by run
    counted: Mapping[str, tuple[int, ...]] = field(default_factory=dict)  #: "run", "mounting" -> numbers, rising
    rate_dps: float = 1.0  #: the greatest
    span_c: tuple[float, float] = (0.0, 1.0)

    def numbers(self, name: str) -> tuple[int, ...]:
        """Return which runs or mountings there are."""
        return self.counted.get(name, (1,))

    def rate_k_min(self, channels: Channels, over_s: float) -> Array:
        """Return how fast the temperature changes, (n,) K/min, as the slope of a line over so many seconds."""
        return self._ask(channels, lambda course: _slope(course.temperature_c, over_s))

    def lag_k(self, channels: Channels, tau_s: float) -> Array:
        """Return how far a part with a time constant is behind the thermometer, (n,) K."""
        return self._ask(channels, lambda course: _behind(course.temperature_c, tau_s))

    def leg(self, channels: Channels, width_k: float) -> Array:
        """Return from which side the temperature came, (n,), 1 from below to -1; it turns over within a width."""
        return self._ask(channels, lambda course: _play(course.temperature_c, width_k))

    def _ask(self, channels: Channels, question: Any) -> Array:
        if not self.courses:
            return np.zeros(len(channels))
        t_s = np.asarray(channels["t_s"], dtype=np.float64)
        run = np.asarray(channels["run"]) if "run" in channels else np.ones(len(t_s), dtype=np.int64)
        found = np.zeros(len(t_s))
        for number, course in self.courses.items():
            here = run == number
            if here.any():
                found[here] = course.at(question(course), t_s[here])
        return found


def _slope(temperature_c: Array, over_s: float) -> Array:
    half = max(round(over_s / SPACING_S / 2), 1)
    if len(temperature_c) < 3:
        return np.zeros(len(temperature_c))
    padded = np.pad(temperature_c, half, mode="edge")
    weights = np.arange(-half, half + 1, dtype=np.float64)
    weights /= (weights**2).sum() * SPACING_S / 60.0
    return np.asarray(np.convolve(padded, weights[::-1], mode="valid"))


def _behind(temperature_c: Array, tau_s: float) -> Array:
    """Return how far a first-order follower is behind: f[i] - keep f[i-1] = (1 - keep) T[i], at rest at the start."""
    keep = np.exp(-SPACING_S / tau_s)
    band = np.array([np.ones(len(temperature_c)), np.full(len(temperature_c), -keep)])
    pull = (1 - keep) * temperature_c
    pull[0] = temperature_c[0]
    return np.asarray(solve_banded((1, 0), band, pull) - temperature_c)


def _play(temperature_c: Array, width_k: float) -> Array:
    """Return how far a follower with play is behind the temperature, over half of the play: -1 to 1."""
    half = width_k / 2
    behind = np.empty(len(temperature_c))
    follower = temperature_c[0]
    for index, now in enumerate(temperature_c.tolist()):
        follower = min(max(follower, now - half), now + half)
        behind[index] = now - follower
    return behind / half


def past_of(recording: Recording) -> TemperatureHistory:
    """Return the history of a recording: from its environment where that was logged, else from its data sets."""
    columns = recording.columns
    environment = recording.environment
    source = environment if environment and "temperature_c" in environment and "t_s" in environment else columns
    counted = {
        name: tuple(int(number) for number in np.unique(np.asarray(columns[name])))
        for name in ("run", "mounting")
        if name in columns
    }
    rate = float(np.max(np.abs(np.asarray(columns["table_rate_dps"], dtype=np.float64)), initial=0.0)) or 1.0
    warm = np.asarray(columns["temperature_c"], dtype=np.float64)
    span = (float(warm.min()), float(warm.max())) if len(warm) else (0.0, 1.0)
    if "t_s" not in columns:
        return TemperatureHistory({}, counted, rate, span)
    return TemperatureHistory(_courses(source, columns), counted, rate, span)


def _courses(source: Mapping[str, Any], columns: Mapping[str, Any]) -> dict[int, TemperatureCourse]:
    t_s = np.asarray(source["t_s"], dtype=np.float64)
    warm = np.asarray(source["temperature_c"], dtype=np.float64)
    there = np.asarray(source["run"]) if "run" in source else np.ones(len(t_s), dtype=np.int64)
    runs = np.unique(np.asarray(columns["run"])) if "run" in columns else np.array([1])
    found = {}
    for run in runs:
        here = (there == run) & np.isfinite(warm)
        if "run" not in source:
            here = np.isfinite(warm)
        if here.sum() < 2:
            continue
        times, values = t_s[here], warm[here]
        order = np.argsort(times, kind="stable")
        grid = np.arange(times[order][0], times[order][-1] + SPACING_S, SPACING_S)
        found[int(run)] = TemperatureCourse(float(grid[0]), np.interp(grid, times[order], values[order]))
    return found
