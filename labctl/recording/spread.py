"""The white part of a data set's readings."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

#: The median of an exponential distribution, over its mean: a periodogram's lines do not move its median.
_MEDIAN_TO_MEAN = float(np.log(2.0))
#: Too few readings for a spectrum.
MIN_FOR_SPECTRUM = 32


def white_std(values: NDArray[np.float64]) -> float:
    """Return the standard deviation of the white part of readings (n,), n >= 32, from their periodogram's median.

    Lines from the table's steps make a reading scatter, but average out over a data set; they fill few frequencies, so
    the median does not see them. Neither does it see drift, which fills only the lowest.
    """
    window, power = _window(len(values))  # a strong line must not leak into the frequencies beside it
    spectrum = np.abs(np.fft.rfft((values - values.mean()) * window)[2:-1]) ** 2 / power
    return float(np.sqrt(np.median(spectrum) / _MEDIAN_TO_MEAN))


@lru_cache(maxsize=64)
def _window(number: int) -> tuple[NDArray[np.float64], float]:
    """Return the weights (number,) of the readings of a spectrum, and the sum of their squares."""
    window = np.hanning(number)
    window.flags.writeable = False
    return window, float(np.sum(window**2))
