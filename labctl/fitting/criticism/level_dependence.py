"""What a residual follows by its levels: means at equal rates, and at equal temperatures, whatever the law.

A smooth function of few knots does not follow a law that turns between neighbouring rates. The analysis of variance
of one way does (Fisher): the variance within levels beside that of all data sets.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.temperature.levels import temperature_levels
from labctl.fitting.numeric.arrays import Array

#: Rates within this share of the largest are one level.
SAME_RATE = 1e-3
#: A channel is behind a residual where its levels explain more than this share of the variance.
MOST = 0.5


def levels_behind(data: FitData, residual_dps: Mapping[str, Array]) -> tuple[str, ...]:
    """Return which of rate and temperature a residual (axis -> (m,) deg/s) follows level by level, the stronger first.

    The share of the variance that levels explain is corrected for their number.
    """
    levels: dict[str, Mapping[str, NDArray[np.int64]]] = {
        "table_rate_dps": {axis: _rates(data.true_rate_dps(axis)) for axis in residual_dps}
    }
    temperatures = temperature_levels(data.temperature_c) if data.channels.history.thermometer else None
    if temperatures is not None:
        levels["temperature_c"] = dict.fromkeys(residual_dps, temperatures)
    shares = {name: _share(residual_dps, of_axes) for name, of_axes in levels.items()}
    return tuple(sorted((name for name, share in shares.items() if share > MOST), key=shares.__getitem__, reverse=True))


def _rates(rate_dps: Array) -> NDArray[np.int64]:
    order = np.argsort(rate_dps, kind="stable")
    steps = np.diff(rate_dps[order]) > SAME_RATE * float(np.abs(rate_dps).max(initial=0.0))
    levels = np.empty(len(rate_dps), dtype=np.int64)
    levels[order] = np.concatenate([[0], np.cumsum(steps)])
    return levels


def _share(residual_dps: Mapping[str, Array], levels: Mapping[str, NDArray[np.int64]]) -> float:
    within = total = 0.0
    free = free_within = 0
    for axis, residual in residual_dps.items():
        count = np.bincount(levels[axis])
        means = np.bincount(levels[axis], weights=residual) / np.maximum(count, 1)
        within += float(np.sum((residual - means[levels[axis]]) ** 2))
        total += float(np.sum((residual - residual.mean()) ** 2))
        free, free_within = free + len(residual) - 1, free_within + len(residual) - len(count)
    if free_within < 1 or total == 0.0:
        return 0.0
    return 1.0 - (within / free_within) / (total / free)
