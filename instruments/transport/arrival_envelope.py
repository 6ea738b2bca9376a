"""The line under the arrivals of a stream: bytes can be late, never early, so the least late ones tell the period.

Source: S. B. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay measurements, IEEE
INFOCOM 1999: of all lines that no point lies below, the one with the least sum of distances. It is the edge of the
lower convex hull at the mean of the numbers.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

#: The error of an arrival that is known exactly: rounding of sums of clock times, s.
ROUNDING_S = 1e-9


def line_under(x: Sequence[float], z: Sequence[float]) -> tuple[float, float]:
    """Return offset and slope of the line under points (n >= 1), `x` rising; a single point has the slope 0."""
    hull: list[int] = []
    for k in range(len(x)):
        while len(hull) > 1 and not _turns_up(x, z, hull[-2], hull[-1], k):
            hull.pop()
        hull.append(k)
    if len(hull) == 1:
        return z[0], 0.0
    middle = sum(x) / len(x)
    n = next(n for n in range(1, len(hull)) if x[hull[n]] >= middle)
    left, right = hull[n - 1], hull[n]
    slope = (z[right] - z[left]) / (x[right] - x[left])
    return z[left] - slope * x[left], slope


def _turns_up(x: Sequence[float], z: Sequence[float], first: int, second: int, third: int) -> bool:
    run, rise = x[second] - x[first], z[second] - z[first]
    return rise * (x[third] - x[second]) < (z[third] - z[second]) * run


def least_late(
    index: NDArray[np.int64], lateness_s: NDArray[np.float64], arrival_s: NDArray[np.float64], spacing: int
) -> NDArray[np.int64]:
    """Return which of n readings say the most of the period: the least late one of each `spacing` numbers.

    Of readings that arrived together only the newest counts, the others waited for it.
    """
    newest = np.flatnonzero(np.append(np.diff(arrival_s) > 0.0, True))
    group = (index[newest] - index[-1]) // spacing
    order = np.lexsort((lateness_s[newest], group))
    first = np.flatnonzero(np.diff(group[order], prepend=group[order[0]] - 1))
    return np.asarray(newest[order[first]], dtype=np.int64)
