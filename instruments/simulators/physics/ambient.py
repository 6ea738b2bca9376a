"""Slow changes around a bench, over hours: supply voltage and relative humidity."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def supply_wander_v(t_s: Array) -> Array:
    """Return the deviation of the supply voltage from nominal, (n,) V, at times (n,) s."""
    return _waves(t_s, (0.06, 5.3, 0.0), (0.04, 1.7, 1.0))


def humidity_pct(t_s: Array) -> Array:
    """Return the relative humidity around the bench, (n,) per cent, at times (n,) s."""
    return 45.0 + _waves(t_s, (4.0, 23.0, 2.0), (3.0, 6.1, 0.5), (1.5, 2.3, 4.0))


def _waves(t_s: Array, *waves: tuple[float, float, float]) -> Array:
    """Return a sum of waves, each of an amplitude, a period in hours and a phase."""
    hours = np.asarray(t_s) / 3600.0
    return np.asarray(sum(size * np.sin(2 * np.pi * hours / period + phase) for size, period, phase in waves))
