"""Followers of a temperature through many samples at once, each from where it was before the first of them.

The recurrences are solved in the order of the samples, so samples that come in one array, in several, or one by one
give the same up to rounding. A lag is followed as its distance from the temperature: x + (T - x) would round a small
distance at the last digit of the temperature, at each of millions of steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Steps that differ by less than this many units in the last place of their times are even.
ROUNDED = 4.0
#: Values that one row of a matrix product sums: the product costs as many operations for each value.
LANE = 16
#: Rows of one product: of more, the product would be spread over threads, and small ones wait for each other.
LANES = 512
#: Sums over fewer values are solved one value after the other.
FEW = 16 * LANE
#: A sum over decays is written with growing weights, exp(a): up to this exponent, where they keep 13 digits.
LARGEST_EXPONENT = 60.0
#: Terms of the series of the mean over a step are left out below this share.
NEGLIGIBLE = 5e-17
#: The longest step, in time constants, whose mean is summed as a series; of longer ones it is an exponential.
SERIES_TO = 0.05


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
    passed_s: Array  #: (n,) from the sample before the first, s
    fall_k: Array  #: (n,) of the temperature in each step, K
    now_c: Array  #: (n,) deg C

    @staticmethod
    def of(t_s: Array, now_c: Array, last_s: float, last_c: float) -> Steps:
        """Return the steps of samples at times (n,) and temperatures (n,), after a sample at `last_s` and `last_c`."""
        fall_k = _falls(now_c, last_c)
        step_s = _changes(t_s, last_s)
        mean_s = (float(t_s[-1]) - last_s) / len(t_s)
        ulp = np.spacing(max(abs(float(t_s[-1])), abs(last_s)))
        if len(t_s) > 1 and float(step_s.max() - step_s.min()) <= ROUNDED * ulp:
            return Steps(np.array([mean_s]), _counted(len(t_s)) * mean_s, fall_k, now_c)
        return Steps(step_s, t_s - last_s, fall_k, now_c)

    @staticmethod
    def even(course_c: Array, step_s: float) -> Steps:
        """Return the steps of an evenly spaced course (n,), the first of them from its own temperature."""
        passed_s = _counted(len(course_c)) * step_s
        return Steps(np.array([step_s]), passed_s, _falls(course_c, float(course_c[0])), course_c)

    def lagged(self, tau_s: float, behind_k: float) -> Array:
        """Return a first-order follower less the temperature after each step, (n,) K, from `behind_k` before them.

        Exact for temperatures on straight lines.
        """
        if len(self.step_s) > 1:
            ratios = self.step_s / tau_s
            return _decayed(ratios, self.passed_s / tau_s, _means(ratios) * self.fall_k, behind_k)
        keep, _, new = lag_shares(float(self.step_s[0]), tau_s)
        return _decaying_sum(keep, (1.0 - new) * self.fall_k, behind_k)

    def lagged_two_ways(self, warming_s: float, cooling_s: float, behind_k: float) -> Array:
        """Return the same of one with another time constant in steps that end below where it was at their start.

        Which steps these are depends on the answer: it is found again until they stay the same. All samples up to the
        first that still changes are final, so that each pass gets further, as a rule to the end in one or two: a
        follower is far from where a lag matters, and slow.
        """
        start_k = behind_k
        cools = self.now_c < float(self.now_c[0] + self.fall_k[0]) + behind_k
        lag_k = np.empty_like(self.now_c)
        begin = 0
        while True:
            after_begin = slice(begin, None)
            lag_k[after_begin] = self._two_ways(warming_s, cooling_s, cools, begin, start_k)
            cooled = np.empty_like(cools[after_begin])
            cooled[0] = start_k + self.fall_k[begin] > 0
            np.greater(lag_k[begin:-1] + self.fall_k[begin + 1 :], 0.0, out=cooled[1:])
            changed = cooled != cools[after_begin]
            first = int(np.argmax(changed))
            if not changed[first]:
                return lag_k
            cools[after_begin] = cooled
            begin += first
            start_k = behind_k if begin == 0 else float(lag_k[begin - 1])

    def _two_ways(
        self, warming_s: float, cooling_s: float, cools: NDArray[np.bool_], begin: int, behind_k: float
    ) -> Array:
        """Return the follower from a step on, where it is known which steps cool (n,)."""
        cooling = cools[begin:]
        after_begin = Steps(
            self.step_s[begin:] if len(self.step_s) > 1 else self.step_s,
            self.passed_s[begin:] - (self.passed_s[begin - 1] if begin else 0.0),
            self.fall_k[begin:], self.now_c[begin:],
        )  # fmt: skip
        if cooling.all() or not cooling.any():
            return after_begin.lagged(cooling_s if cooling[0] else warming_s, behind_k)
        per_s = np.where(cooling, 1.0 / cooling_s, 1.0 / warming_s)
        ratios = after_begin.step_s * per_s
        exponents = _decaying_sum(1.0, ratios.copy(), 0.0)
        return _decayed(ratios, exponents, _means(ratios) * after_begin.fall_k, behind_k)

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


def _changes(values: Array, last: float) -> Array:
    """Return by how much each value, (n,), is more than the one before it, the first of them `last`."""
    changes = np.empty_like(values)
    changes[0] = values[0] - last
    np.subtract(values[1:], values[:-1], out=changes[1:])
    return changes


def _falls(values: Array, last: float) -> Array:
    """Return by how much each value, (n,), is less than the one before it, the first of them `last`."""
    falls = np.empty_like(values)
    falls[0] = last - values[0]
    np.subtract(values[:-1], values[1:], out=falls[1:])
    return falls


@lru_cache(maxsize=2)
def _counted(n: int) -> Array:
    """Return 1 to n."""
    return np.arange(1.0, n + 1.0)


def _means(ratios: Array) -> Array:
    """Return the mean of a decay over each of some steps, given in time constants, (n,): (1 - exp(-r)) / r.

    Steps are short beside a time constant, as a rule: a few terms of the series then are exact, and cost less.
    """
    longest = float(ratios.max())
    if longest > SERIES_TO:
        safe = np.where(ratios > 0, ratios, 1.0)
        return np.where(ratios > 0, -np.expm1(-safe) / safe, 1.0)
    terms = [1.0, -1.0 / 2]
    while abs(following := -terms[-1] / (len(terms) + 1)) * longest ** len(terms) > NEGLIGIBLE:
        terms.append(following)
    means = ratios * terms[-1]
    for term in terms[-2:0:-1]:
        means += term
        means *= ratios
    means += 1.0
    return means


def _decayed(ratios: Array, exponents: Array, pull: Array, start: float) -> Array:
    """Return x with x_k = exp(-ratios_k) x_(k-1) + pull_k, (n,), from `start`; writes over the exponents and `pull`.

    As a sum, exp(a_k) x_k is that of exp(a_j) pull_j up to k, where the exponents a are the sums of the ratios. Its
    rounding decays with the terms themselves.
    """
    if len(pull) < FEW or float(exponents[-1]) > LARGEST_EXPONENT:
        return _one_by_one(np.exp(-ratios), pull, start)
    weights = np.exp(exponents, out=exponents)
    pull *= weights
    decayed = _decaying_sum(1.0, pull, start)
    decayed /= weights
    return decayed


def _decaying_sum(keep: float, values: Array, start: float) -> Array:
    """Return x with x_k = keep x_(k-1) + values_k, (n,), from `start`; writes over `values`.

    Lanes of values are summed by a matrix product, after the first of each got what is left of the lanes before it.
    """
    n = len(values)
    whole = n - n % LANE
    if n < FEW:
        return _one_by_one(keep, values, start)
    within, whole_lane = _lane(keep)
    sums = np.empty(n)
    lanes = sums[:whole].reshape(-1, LANE)
    in_lanes = values[:whole].reshape(-1, LANE)
    in_lanes[0, 0] += keep * start
    ends = _decaying_sum(whole_lane, in_lanes[:-1] @ within[:, -1], 0.0)
    in_lanes[1:, 0] += keep * ends
    for begin in range(0, len(lanes), LANES):
        np.matmul(in_lanes[begin : begin + LANES], within, out=lanes[begin : begin + LANES])
    if whole < n:
        sums[whole:] = _one_by_one(keep, values[whole:], float(sums[whole - 1]))
    return sums


@lru_cache(maxsize=16)
def _lane(keep: float) -> tuple[Array, float]:
    """Return what is left of the values of a lane at each of its places, (LANE, LANE), and after a lane's length."""
    powers = np.power(keep, np.arange(LANE + 1.0))
    places = np.arange(LANE)
    after = places[None, :] - places[:, None]
    return np.where(after >= 0, powers[np.maximum(after, 0)], 0.0), float(powers[-1])


def _one_by_one(keep: Array | float, pull: Array, start: float) -> Array:
    """Return x with x_k = keep_k x_(k-1) + pull_k, (n,), from `start`."""
    keeps = keep.tolist() if isinstance(keep, np.ndarray) else repeat(keep)
    steps = zip(keeps, pull.tolist(), strict=False)
    return np.fromiter(
        (start := factor * start + pulled for factor, pulled in steps), dtype=np.float64, count=len(pull)
    )
