"""Data sets whose rate changes: short stretches of them, output beside rate, stand for data sets at one rate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Stretches of a data set that are inspected, and readings of each.
STRETCHES, READINGS = 500, 4
#: An output may be late by this long, s, and this many readings early.
LATEST_S, EARLIEST = 0.25, 10
#: The shortest lag is taken at which output and rate agree to this share of their best agreement.
NEARLY = 0.95


def stretches(n: int) -> list[slice]:
    """Return evenly spread stretches of n readings, all of them where they are few."""
    number = max(min(STRETCHES, n // READINGS), 1)
    begins = np.linspace(0, max(n - READINGS, 0), number).astype(np.int64)
    return [slice(int(begin), int(min(begin + READINGS, n))) for begin in begins]


def lag_of(rate_dps: NDArray[np.float64], output: NDArray[np.float64], step_s: float) -> int:
    """Return by how many readings an output (n,) is late against the rate (n,); it may have the other sign.

    A delay must not look like a wrong sign or scale: at 10 Hz 50 ms are half a period.
    """
    n = len(rate_dps)
    rate, values = rate_dps - rate_dps.mean(), output - output.mean()
    if n < 4 * READINGS or not np.any(rate) or not np.any(values):
        return 0
    latest = int(min(LATEST_S / max(step_s, 1e-9), n // 4))
    lags = np.arange(-min(EARLIEST, n // 4), latest + 1)
    spectrum = np.fft.rfft(values, 2 * n) * np.fft.rfft(rate, 2 * n).conj()
    agree = np.abs(np.fft.irfft(spectrum, 2 * n)[lags])  # by lag: a negative one counts from the end
    good = lags[agree >= NEARLY * agree.max()]
    return int(good[np.argmin(np.abs(good))])
