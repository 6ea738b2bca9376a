"""Bias instability: a sum of Ornstein-Uhlenbeck processes on a grid of seconds, linear between grid points."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRID_S = 1.0


@dataclass(frozen=True, slots=True)
class _Interval:
    """A grid interval that holds readings."""

    from_s: float
    skipped_s: float  #: between the last interval and this one
    draws: int  #: from the normal distribution, to come here
    readings: int


class BiasInstability:
    """Bias of each axis at times that only rise. `sd_dps` is the standard deviation of the sum, `taus_s` its times."""

    def __init__(self, rng: np.random.Generator, sd_dps: float, taus_s: tuple[float, ...], axes: int) -> None:
        self._rng = rng
        self._taus_s = np.asarray(taus_s)
        self._sd_dps = sd_dps / np.sqrt(len(self._taus_s))
        self._axes = axes
        self._here = rng.normal(0.0, self._sd_dps, (len(self._taus_s), axes))
        self._next = self._here.copy()
        self._here_s = 0.0

    def sample(self, t_s: Array) -> Array:
        """Return the bias, (n, axes) deg/s, at rising times (n,)."""
        if len(t_s) == 0:
            return np.empty((0, self._axes))
        intervals = self._intervals(t_s.tolist())
        ends = self._ends(intervals)
        drawn = np.cumsum([i.draws for i in intervals])
        number = np.repeat(np.arange(len(intervals)), [i.readings for i in intervals])
        share = ((t_s - np.array([i.from_s for i in intervals])[number]) / GRID_S)[:, None]
        bias: Array = np.stack([ends[drawn], ends[drawn + 1]], axis=1).sum(2)
        return np.asarray(bias[number, 0] * (1 - share) + bias[number, 1] * share)

    def _intervals(self, times_s: list[float]) -> list[_Interval]:
        """Return the grid intervals that hold rising times, from where the process is now."""
        intervals, start, here_s = [], 0, self._here_s
        while start < len(times_s):
            skipped_s, draws = 0.0, 0
            if times_s[start] >= here_s + GRID_S:
                skipped_s = max((times_s[start] - here_s) // GRID_S - 1.0, 0.0) * GRID_S
                here_s += skipped_s + GRID_S
                draws = 2 if skipped_s else 1
            stop = bisect_left(times_s, here_s + GRID_S, start)
            intervals.append(_Interval(here_s, skipped_s, draws, stop - start))
            start = stop
        self._here_s = here_s
        return intervals

    def _ends(self, intervals: list[_Interval]) -> Array:
        """Return the processes at the ends of the last interval and then after each draw, (draws + 2, taus, axes).

        Plain numbers in one loop: for the nine processes of a unit that takes a third of the time of sums of arrays.
        """
        over_s = [GRID_S if last else i.skipped_s for i in intervals for last in (False, True)[2 - i.draws :]]
        draws = self._rng.standard_normal((len(over_s), *self._here.shape))
        keep, scatter = self._over(np.array(over_s))
        ends = np.concatenate([[self._here, self._next], scatter[:, :, None] * draws])
        for tau, axis in np.ndindex(self._here.shape):
            value, course = float(self._next[tau, axis]), []
            for kept, change in zip(keep[:, tau].tolist(), ends[2:, tau, axis].tolist(), strict=True):
                value = kept * value + change
                course.append(value)
            ends[2:, tau, axis] = course
        self._here, self._next = ends[-2], ends[-1]
        return ends

    def _over(self, elapsed_s: Array) -> tuple[Array, Array]:
        """Return what share of each process stays over times (n,), and the scatter that it gains, deg/s; (n, taus)."""
        keep = np.exp(-elapsed_s[:, None] / self._taus_s)
        return keep, self._sd_dps * np.sqrt(1 - keep**2)
