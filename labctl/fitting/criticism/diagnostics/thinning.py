"""Which data sets of a very long recording are drawn one by one: some of each position, rate and temperature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.levels import rate_levels
from labctl.fitting.numeric.arrays import Array

#: Data sets that are drawn one by one; a longer recording is thinned to so many.
MOST_DRAWN = 3000
#: With more strata than one in this many drawn data sets, neighbouring rates of one sign share a stratum.
LEAST_PER_STRATUM = 8
GOLDEN = 0.6180339887498949


def drawn_rows(
    position: NDArray[np.str_], table_rate_dps: Array, temperature_c: Array, most: int = MOST_DRAWN
) -> NDArray[np.int64]:
    """Return which of n data sets are drawn, rising: all of them, or `most` of them.

    Strata are position and signed rate level. Each gives its data sets in an order that spreads over its
    temperatures (van der Corput), and all strata give equally many as long as they have any left.
    """
    n = len(table_rate_dps)
    if n <= most:
        return np.arange(n)
    stratum = _strata(position, table_rate_dps, max(most // LEAST_PER_STRATUM, 1))
    turn = np.empty(n)
    for number in np.unique(stratum):
        rows = np.flatnonzero(stratum == number)
        warmer = rows[np.argsort(temperature_c[rows], kind="stable")]
        begin = int(number * GOLDEN % 1.0 * len(rows))  # not every stratum begins with its coldest
        turn[np.roll(warmer, begin)[_spread(len(rows))]] = np.arange(len(rows))
    return np.sort(np.lexsort((stratum, turn))[:most])


def _strata(position: NDArray[np.str_], table_rate_dps: Array, most: int) -> NDArray[np.int64]:
    """Return a number for each position and signed rate level, (n,); neighbouring rates share one beyond `most`."""
    _, place = np.unique(position, return_inverse=True)
    level = rate_levels(table_rate_dps)
    allowed = max(most // (int(place.max()) + 1), 3)
    if int(level.max()) + 1 > allowed:
        sign = np.sign(table_rate_dps).astype(np.int64)
        ranks = np.argsort(np.argsort(level, kind="stable"), kind="stable")
        _, level = np.unique(sign * (len(level) + 1) + ranks * (allowed - 2) // len(level), return_inverse=True)
    return np.asarray(place * (int(level.max()) + 1) + level, dtype=np.int64)


def _spread(n: int) -> NDArray[np.int64]:
    """Return 0 .. n-1 in an order of which every beginning is spread evenly: ranks of the van der Corput sequence."""
    bits = max(int(n - 1).bit_length(), 1)
    codes = np.arange(2**bits)
    reverse = np.zeros_like(codes)
    for k in range(bits):
        reverse |= ((codes >> k) & 1) << (bits - 1 - k)
    return np.asarray(reverse[reverse < n], dtype=np.int64)
