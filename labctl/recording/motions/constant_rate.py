"""One rate per data set: where the column of the table's rate changes within a data set."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labctl.recording.points import dataset_starts

#: A rate may vary by this share of itself plus this much, deg/s: a servo's or an encoder's ripple.
SHARE, MIN_DPS = 0.01, 0.05
#: Pieces of a data set whose mean rates are compared, and noises of such a mean that do not count.
PIECES, NOISES = 8, 6.0
#: The shortest pieces have so many readings: single wrong ones do not move their median.
MIN_READINGS = 16
#: A table's ripple within a data set is at most this share of the rate plus this much, deg/s.
RIPPLE, RIPPLE_DPS = 0.05, 0.5


class RateChange(NamedTuple):
    """The first data set whose rate changes: its number, the row from 0, and the rates before and there, deg/s."""

    dataset: int
    row: int
    before_dps: float
    after_dps: float


def rate_change(
    dataset: NDArray[np.int64], rate_dps: NDArray[np.float64], valid: NDArray[np.bool_]
) -> RateChange | None:
    """Return where valid readings (n,) of one data set have two rates; None where each data set has one.

    A measured rate may be noisy: means over pieces of the data set are compared.
    """
    rows = np.flatnonzero(valid)
    if len(rows) == 0:
        return None
    rate, number = rate_dps[rows], dataset[rows]
    starts = dataset_starts(number)
    low, high = np.minimum.reduceat(rate, starts), np.maximum.reduceat(rate, starts)
    allowed = SHARE * np.maximum(np.abs(low), np.abs(high)) + MIN_DPS
    ends = np.append(starts[1:], len(rate))
    for k in np.flatnonzero(high - low > allowed):
        segment = rate[starts[k] : ends[k]]
        if not _is_sustained(segment, float(allowed[k])):
            continue
        first = float(np.median(segment[: max(len(segment) // PIECES, 1)]))
        at = int(np.argmax(np.abs(segment - first) > allowed[k]))
        return RateChange(int(number[starts[k]]), int(rows[starts[k] + at]), first, float(segment[at]))
    return None


def _is_sustained(rate: NDArray[np.float64], allowed: float) -> bool:
    """Whether rates (n,) of one data set differ for longer than single readings do by noise.

    Pieces of an eighth show a rate that drifts. Shorter ones show a motion that repeats, whose eighths may have one
    mean; by them ripple of a table is no motion.
    """
    if len(rate) < 2 * PIECES:
        return True
    steps = np.abs(np.diff(rate))
    noise = float(np.sqrt(np.mean(np.sort(steps)[: int(0.9 * len(steps))] ** 2) / 2))
    edges = np.linspace(0, len(rate), PIECES + 1).astype(np.int64)
    means = np.add.reduceat(rate, edges[:-1]) / np.diff(edges)
    if np.ptp(means) > allowed + NOISES * noise / np.sqrt(len(rate) / PIECES):
        return True
    ripple = RIPPLE * float(np.abs(rate).max()) + RIPPLE_DPS
    size = len(rate) // (4 * PIECES)
    while size >= MIN_READINGS:
        pieces = len(rate) // size
        medians = np.median(rate[: pieces * size].reshape(pieces, size), axis=1)
        if np.ptp(medians) > ripple + 2 * NOISES * noise / np.sqrt(size):
            return True
        size //= 4
    return False
