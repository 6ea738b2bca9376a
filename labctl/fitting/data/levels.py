"""Rates and temperatures that count as one when data sets are put into cells: equal within what can be measured."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.temperature.levels import temperature_levels
from labctl.fitting.numeric.arrays import Array

#: Rates closer than this are one: a share of the rate itself, and no less than a table can hold, deg/s.
SAME_RATE, MIN_RATE_STEP_DPS = 1e-3, 1e-3
#: Temperatures closer than this are one: what a thermometer repeats, deg C.
SAME_TEMPERATURE_C = 0.25


def rate_levels(table_rate_dps: Array) -> NDArray[np.int64]:
    """Return the level of each rate, (n,) from 0 rising: within 0.1 % of the rate, at least 0.001 deg/s."""
    return _levels(table_rate_dps, lambda first: max(SAME_RATE * abs(first), MIN_RATE_STEP_DPS))


def temperature_rows(
    temperature_c: Array, position: NDArray[np.str_], rate_level: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return the row of each data set in a map over temperature, (n,) from 0 rising.

    Rows are the recording's temperature levels, as long as no cell (position, rate, row) unites temperatures more than
    0.25 K apart; else, and without discrete levels, temperatures within 0.25 K of the row's lowest.
    """
    levels = temperature_levels(temperature_c)
    if levels is not None and _widest_cell(temperature_c, position, rate_level, levels) <= SAME_TEMPERATURE_C:
        return levels
    return _levels(temperature_c, lambda _: SAME_TEMPERATURE_C)


def level_centres(values: Array, level: NDArray[np.int64]) -> Array:
    """Return for each value, (n,), the mean of its level."""
    return np.asarray((np.bincount(level, values) / np.maximum(np.bincount(level), 1))[level])


def widest(values: Array, level: NDArray[np.int64]) -> float:
    """Return the largest span of values within one level, in their unit; 0 without any."""
    if not len(values):
        return 0.0
    order = np.argsort(level, kind="stable")
    begins = np.flatnonzero(np.diff(level[order], prepend=level[order[0]] - 1))
    ordered = values[order]
    return float(np.max(np.maximum.reduceat(ordered, begins) - np.minimum.reduceat(ordered, begins)))


def _widest_cell(
    values: Array, position: NDArray[np.str_], rate_level: NDArray[np.int64], row: NDArray[np.int64]
) -> float:
    if not len(values):
        return 0.0
    _, place = np.unique(position, return_inverse=True)
    cell = (place * (int(rate_level.max()) + 1) + rate_level) * (int(row.max()) + 1) + row
    return widest(values, np.unique(cell, return_inverse=True)[1])


def _levels(values: Array, width: Callable[[float], float]) -> NDArray[np.int64]:
    order = np.argsort(values, kind="stable")
    level = np.empty(len(values), dtype=np.int64)
    number, first = -1, -np.inf
    for k in order.tolist():
        if values[k] - first > width(first if np.isfinite(first) else 0.0):
            number, first = number + 1, float(values[k])
        level[k] = number
    return level
