"""Rates and temperatures at which the uncertainty over a calibrated range is shown and bounded."""

from __future__ import annotations

import math

from labctl.fitting.data.temperature.channel import STAND_IN_C

#: Rates of a grid are at least this share of the fastest apart.
RATES_APART = 0.02
#: A calibration over less is one temperature, K.
MIN_SPAN_K = 1.0


def grid_rates(low_dps: float, high_dps: float) -> list[float]:
    """Return zero, both limits and half of each, deg/s, as far as they are within the limits and apart, rising."""
    apart = RATES_APART * max(abs(low_dps), abs(high_dps))
    grid: list[float] = []
    for rate in (0.0, low_dps, high_dps, low_dps / 2, high_dps / 2):
        if low_dps <= rate <= high_dps and all(abs(rate - other) > apart for other in grid):
            grid.append(rate)
    return sorted(grid)


def grid_temperatures(low_c: float, high_c: float) -> list[float]:
    """Return the lowest, the middle and the highest temperature, deg C, or the middle of a calibration at one.

    Without limits, of a calibration made without a thermometer, any one stands for all.
    """
    if not math.isfinite(high_c - low_c):
        return [STAND_IN_C]
    middle = (low_c + high_c) / 2
    return [low_c, middle, high_c] if high_c - low_c >= MIN_SPAN_K else [middle]
