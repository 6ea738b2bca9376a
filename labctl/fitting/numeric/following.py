"""Followers of a temperature through many samples at once, each from where it was before the first of them.

The recurrences are solved in the order of the samples, so samples that come in one array, in several, or one by one
give the same up to rounding.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs

from labctl.fitting.numeric.arrays import Array

#: Steps that differ by less than this many units in the last place of their times are even.
ROUNDED = 4.0


def lag_shares(step_s: float, tau_s: float) -> tuple[float, float, float]:
    """Return the weights of follower, last and new temperature in the value of a first-order follower after a step.

    Exact for a temperature that changes linearly through the step, however long it is.
    """
    ratio = step_s / tau_s
    keep = math.exp(-ratio)
    mean = -math.expm1(-ratio) / ratio if ratio > 0 else 1.0
    return keep, mean - keep, 1.0 - mean


@dataclass(frozen=True)
class Steps:
    """Steps from one sample to the next, the first of them from the sample before: durations, s, and temperatures."""

    step_s: Array  #: (n,), or (1,) where all are even
    before_c: Array  #: (n,) deg C
    now_c: Array  #: (n,) deg C

    @staticmethod
    def of(t_s: Array, now_c: Array, last_s: float, last_c: float) -> Steps:
        """Return the steps of samples at times (n,) and temperatures (n,), after a sample at `last_s` and `last_c`."""
        before_c = np.empty_like(now_c)
        before_c[0], before_c[1:] = last_c, now_c[:-1]
        step_s = np.empty_like(t_s)
        step_s[0] = t_s[0] - last_s
        np.subtract(t_s[1:], t_s[:-1], out=step_s[1:])
        mean_s = (float(t_s[-1]) - last_s) / len(t_s)
        ulp = np.spacing(max(abs(float(t_s[-1])), abs(last_s)))
        is_even = len(t_s) > 1 and float(np.ptp(step_s)) <= ROUNDED * ulp
        return Steps(np.array([mean_s]) if is_even else step_s, before_c, now_c)

    @staticmethod
    def even(course_c: Array, step_s: float) -> Steps:
        """Return the steps of an evenly spaced course (n,), the first of them from its own temperature."""
        return Steps(np.array([step_s]), np.concatenate([course_c[:1], course_c[:-1]]), course_c)

    def lagged(self, tau_s: float, at_c: float) -> Array:
        """Return a first-order follower after each step, (n,) deg C; exact for temperatures on straight lines."""
        keep, pull = self._first_order(tau_s)
        return _followed(keep, pull, at_c)

    def lagged_two_ways(self, warming_s: float, cooling_s: float, at_c: float) -> Array:
        """Return the same of one with another time constant in steps that end below where it was at their start.

        Which steps these are depends on the answer: it is found again until they stay the same. All samples up to the
        first that still changes are final, so that each pass gets further, as a rule to the end in a few.
        """
        cools = self.now_c < self.before_c
        keep, pull = self._two_ways(warming_s, cooling_s, cools, slice(None))
        found = np.empty_like(self.now_c)
        begin = 0
        while True:
            rest = slice(begin, None)
            start = at_c if begin == 0 else float(found[begin - 1])
            found[rest] = _followed(keep[rest], pull[rest].copy(), start)
            cooled = np.empty_like(cools[rest])
            cooled[0] = self.now_c[begin] < start
            np.less(self.now_c[begin + 1 :], found[begin:-1], out=cooled[1:])
            changed = begin + np.flatnonzero(cooled != cools[rest])
            if len(changed) == 0:
                return found
            cools[rest] = cooled
            keep[changed], pull[changed] = self._two_ways(warming_s, cooling_s, cools, changed)
            begin = int(changed[0])

    def _two_ways(
        self, warming_s: float, cooling_s: float, cools: NDArray[np.bool_], rows: slice | NDArray[np.int64]
    ) -> tuple[Array, Array]:
        """Return what is kept in some steps, each of which warms or cools (n,), and where it is pulled to, (.,)."""
        own = cools[rows]
        before_c, now_c = self.before_c[rows], self.now_c[rows]
        if len(self.step_s) > 1:
            keeps, means = _shares(self.step_s[rows] / np.where(own, cooling_s, warming_s))
            return keeps, (means - keeps) * before_c + (1.0 - means) * now_c
        step_s = float(self.step_s[0])
        both = zip(lag_shares(step_s, cooling_s), lag_shares(step_s, warming_s), strict=True)
        keep, last, new = (np.where(own, cooling, warming) for cooling, warming in both)
        return keep, last * before_c + new * now_c

    def _first_order(self, tau_s: float) -> tuple[Array | float, Array]:
        """Return what is kept of a first-order follower in each step, (n,) or one, and where it is pulled to."""
        if len(self.step_s) == 1:
            keep, last, new = lag_shares(float(self.step_s[0]), tau_s)
            pull = last * self.before_c
            pull += new * self.now_c
            return keep, pull
        keeps, means = _shares(self.step_s / tau_s)
        return keeps, (means - keeps) * self.before_c + (1.0 - means) * self.now_c

    def played(self, width_k: float, at_c: float) -> Array:
        """Return a follower that the temperature carries along at the edges of a play of this width, (n,) deg C.

        Each temperature clips the follower to within half of the play. Clips one after the other are one clip again, so
        those up to each temperature are found by doubling their number.
        """
        low, high = self.now_c - width_k / 2, self.now_c + width_k / 2
        low[0] = high[0] = min(max(at_c, low[0]), high[0])
        reach = 1
        while reach < len(low) and np.any(low < high):
            low[reach:], high[reach:] = (
                np.minimum(np.maximum(before[:-reach], low[reach:]), high[reach:]) for before in (low, high)
            )
            reach *= 2
        return np.asarray(low)


def _followed(keep: Array | float, pull: Array, at_c: float) -> Array:
    """Return x with x_k = keep_k x_(k-1) + pull_k, (n,), from `at_c`; writes over `pull`."""
    band = np.empty((2, len(pull)), order="F")
    band[0] = 1.0
    if isinstance(keep, np.ndarray):
        band[1, :-1] = -keep[1:]
        pull[0] += keep[0] * at_c
    else:
        band[1] = -keep
        pull[0] += keep * at_c
    found, _ = dtbtrs(band, pull[:, None], uplo="L", diag="U", overwrite_b=True)
    return np.asarray(found[:, 0])


def _shares(ratios: Array) -> tuple[Array, Array]:
    """Return what is kept of a follower after steps in time constants (n,), and its mean over each step."""
    less = np.expm1(-ratios)
    means = np.where(ratios > 0, -less / np.where(ratios > 0, ratios, 1.0), 1.0)
    return 1.0 + less, means
