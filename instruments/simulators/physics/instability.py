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
        self._step = self._over(GRID_S)
        self._here = rng.normal(0.0, self._sd_dps, (len(self._taus_s), axes))
        self._next = self._here.copy()
        self._here_s = 0.0

    def sample(self, t_s: Array) -> Array:
        """Return the bias, (n, axes) deg/s, at rising times (n,)."""
        if len(t_s) == 0:
            return np.empty((0, self._axes))
        intervals = self._intervals(t_s.tolist())
        draws = self._rng.standard_normal((sum(i.draws for i in intervals), *self._here.shape))
        ends = np.empty((len(intervals), 2, *self._here.shape))
        drawn = 0
        for interval, end in zip(intervals, ends, strict=True):
            self._advance(interval, draws[drawn : drawn + interval.draws])
            drawn += interval.draws
            end[0], end[1] = self._here, self._next
        number = np.repeat(np.arange(len(intervals)), [i.readings for i in intervals])
        share = ((t_s - np.array([i.from_s for i in intervals])[number]) / GRID_S)[:, None]
        bias: Array = ends.sum(2)
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

    def _advance(self, interval: _Interval, draws: Array) -> None:
        """Move to an interval by its draws from the normal distribution, (draws, taus, axes)."""
        if interval.draws:
            last = self._next
            self._here = _after(last, self._over(interval.skipped_s), draws[0]) if interval.skipped_s else last
            self._next = _after(self._here, self._step, draws[-1])

    def _over(self, elapsed_s: float) -> tuple[Array, Array]:
        """Return what share of each process stays over a time, and the scatter that it gains, deg/s; (taus, 1) each."""
        keep = np.exp(-elapsed_s / self._taus_s)[:, None]
        return keep, self._sd_dps * np.sqrt(1 - keep**2)


def _after(bias: Array, over: tuple[Array, Array], draws: Array) -> Array:
    keep, scatter = over
    return keep * bias + scatter * draws
