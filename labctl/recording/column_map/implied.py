"""What a unit of time implies, and what of it is impossible: readings per second, and kelvin per second."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Instants since 1970 that logs can be of: 2001 to 2060, s. Seconds since 1904, of LabVIEW, begin beyond.
EPOCH_S = (1e9, 2.84e9)
#: No clock that counts from power-on, in a unit that is only guessed, shows more than this: three years, s.
LONGEST_UPTIME_S = 1e8
#: The fastest outputs of gyros have 32,000 readings a second; a wrong prefix implies a thousand times as many.
FASTEST_HZ = 50_000.0
#: A thermal stream warms a part by some kelvin in a second, and no chamber does.
STEEPEST_K_S = 20.0
#: A change of temperature counts from here on, K: below, it may be the resolution of a thermometer.
MIN_CHANGE_K = 0.3
#: A log is divided into so many blocks, of at least so many readings.
_BLOCKS, _MIN_READINGS = 10, 20
#: A change of the mean counts beyond so many of its standard deviations.
_TIMES_NOISE = 6.0


def steepest_k_s(t_s: Array, temperature_c: Array) -> float:
    """Return the steepest change of temperature that is beyond its noise, K/s; 0 where there is none.

    From the mean temperature (n,) of one block of readings to that of the next, by the times (n,) in s.
    """
    n = len(t_s)
    blocks = min(_BLOCKS, n // _MIN_READINGS)
    if blocks < 2 or not np.isfinite(temperature_c).all():
        return 0.0
    edges = np.linspace(0, n, blocks + 1).astype(np.int64)
    counts = np.diff(edges)
    at = np.add.reduceat(t_s, edges[:-1]) / counts
    means = np.add.reduceat(temperature_c, edges[:-1]) / counts
    noise = float(np.median(np.abs(np.diff(temperature_c)))) + 1e-12
    steepest = 0.0
    for width in (1, blocks - 1):
        change = np.abs(means[width:] - means[:-width])
        counted = (change > MIN_CHANGE_K) & (change > _TIMES_NOISE * noise / np.sqrt(counts.min()))
        steep = change[counted] / np.maximum((at[width:] - at[:-width])[counted], 1e-12)
        steepest = max(steepest, float(steep.max(initial=0.0)))
    return steepest


def too_steep(t_s: Array, temperature_c: Array) -> bool:
    """Whether a temperature changes faster by these times than any does."""
    return steepest_k_s(t_s, temperature_c) > STEEPEST_K_S
