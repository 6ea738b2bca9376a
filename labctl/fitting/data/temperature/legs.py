"""Legs of a recording: stretches in which the temperature rises, and stretches in which it falls."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: A turn back by less than this share of the range, or by less than this, deg C, does not count.
MIN_SHARE, MIN_K = 0.2, 2.0


def legs_of(temperature_c: Array, run: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the leg of each data set in order of time, (n,): 1, 2, 3 ... while it warms up, -1, -2 ... while it cools.

    Legs are counted from the start, over all powered runs; a turn counts when the temperature has gone back by a fifth
    of its range and by 2 K. 0 where the temperature never moves by as much.
    """
    legs = np.zeros(len(temperature_c), dtype=np.int64)
    least = max(MIN_SHARE * float(np.ptp(temperature_c)), MIN_K) if len(temperature_c) else MIN_K
    counted = 0
    for number in np.unique(run):
        rows = np.flatnonzero(run == number)
        for begin, end, direction in _stretches(temperature_c[rows], least):
            counted += 1
            legs[rows[begin:end]] = direction * counted
    return legs


def _stretches(temperature_c: Array, least: float) -> list[tuple[int, int, int]]:
    """Return start, end and direction of each leg of one run, (n,) in order of time."""
    stretches: list[tuple[int, int, int]] = []
    begin, direction, low, high = 0, 0, 0, 0
    for k, now in enumerate(temperature_c.tolist()):
        low = k if now <= temperature_c[low] else low
        high = k if now >= temperature_c[high] else high
        if direction <= 0 and now - temperature_c[low] >= least:
            if direction:
                stretches.append((begin, low + 1, -1))
            begin, direction, high = (low + 1 if direction else 0), 1, k
        elif direction >= 0 and temperature_c[high] - now >= least:
            if direction:
                stretches.append((begin, high + 1, 1))
            begin, direction, low = (high + 1 if direction else 0), -1, k
    return [*stretches, (begin, len(temperature_c), direction)] if direction else []
