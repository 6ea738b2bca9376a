"""The white part of a data set's readings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: The median of an exponential distribution, over its mean: a periodogram's lines do not move its median.
_MEDIAN_TO_MEAN = float(np.log(2.0))
#: Too few readings for a spectrum.
MIN_FOR_SPECTRUM = 32
#: Readings that are computed on at once: on a few hundred, numpy's calls cost more than the work, and what is larger
#: than the cache of the processor is slower again.
_AT_ONCE = 1 << 15


def white_std(values: NDArray[np.float64]) -> float:
    """Return the standard deviation of the white part of readings (n,), n >= 32, from their periodogram's median.

    Lines from the table's steps make a reading scatter, but average out over a data set; they fill few frequencies, so
    the median does not see them. Neither does it see drift, which fills only the lowest.
    """
    return float(_white_std_of_rows(values[np.newaxis])[0])


def white_stds(sets: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return `white_std` of each data set, (m,), in the same figures: sets of one length are computed together."""
    stds = np.empty(len(sets))
    for numbers, rows in of_one_length(sets):
        stds[numbers] = _white_std_of_rows(rows)
    return stds


def of_one_length(sets: Sequence[NDArray[np.float64]]) -> Iterator[tuple[list[int], NDArray[np.float64]]]:
    """Yield the numbers of some data sets of n readings each, and their readings, (k, n)."""
    by_length: dict[int, list[int]] = {}
    for number, readings in enumerate(sets):
        by_length.setdefault(len(readings), []).append(number)
    for length, numbers in by_length.items():
        step = max(_AT_ONCE // max(length, 1), 1)
        for begin in range(0, len(numbers), step):
            some = numbers[begin : begin + step]
            yield some, np.array([sets[number] for number in some], dtype=np.float64)


def _white_std_of_rows(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    window, power = _window(rows.shape[1])  # a strong line must not leak into the frequencies beside it
    spectrum = np.abs(np.fft.rfft((rows - rows.mean(axis=1, keepdims=True)) * window)[:, 2:-1]) ** 2 / power
    return np.asarray(np.sqrt(np.median(spectrum, axis=1) / _MEDIAN_TO_MEAN))


@lru_cache(maxsize=64)
def _window(number: int) -> tuple[NDArray[np.float64], float]:
    """Return the weights (number,) of the readings of a spectrum, and the sum of their squares."""
    window = np.hanning(number)
    window.flags.writeable = False
    return window, float(np.sum(window**2))
