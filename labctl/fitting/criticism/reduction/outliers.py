"""Outliers of a data set, and the white noise of a single reading."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: A reading further than this many robust standard deviations from its data set's median is left out ...
OUTLIER = 6.0
#: ... and further than this many times the distance within which nine tenths of the readings lie: a line of the table's
#: steps has few different values; ...
BEYOND = 3.0
#: ... unless such readings are more than this share: then they belong to the data set.
FEW = 0.05

#: The next code is one step away.
NEXT_CODE = 1.5


def inlier_mask(values: NDArray[np.float64], presence: NDArray[np.float64], step: float = 0.0) -> NDArray[np.float64]:
    """Return 1 where a reading is no outlier of its data set, (m, n).

    `step` is the step in which the readings come, in their unit: the next code is no outlier where most have one code.
    """
    count = (presence > 0).sum(axis=1)
    middle = _quantile(np.sort(np.where(presence > 0, values, np.inf), axis=1), count, 0.5)
    distance = np.sort(np.where(presence > 0, np.abs(values - middle), np.inf), axis=1)
    spread, most = 1.4826 * _quantile(distance, count, 0.5), _quantile(distance, count, 1.0 - 2 * FEW)
    far = (np.abs(values - middle) > np.maximum(np.maximum(OUTLIER * spread, BEYOND * most), NEXT_CODE * step)) & (
        presence > 0
    )
    few = far.sum(axis=1, keepdims=True) <= FEW * presence.sum(axis=1, keepdims=True)
    return np.where(far & few, 0.0, 1.0)


def _quantile(ordered: NDArray[np.float64], count: NDArray[np.int64], share: float) -> NDArray[np.float64]:
    """Return the quantile of the first `count` (m,) values of each ordered row (m, n), (m, 1), interpolated."""
    place = share * (np.maximum(count, 1) - 1)
    low = np.floor(place).astype(np.int64)
    rows, high = np.arange(len(ordered)), np.minimum(low + 1, np.maximum(count, 1) - 1)
    below, above = ordered[rows, low], ordered[rows, high]
    return np.asarray(below + (place - low) * (above - below))[:, None]


def white_level_dps(values: NDArray[np.float64], presence: NDArray[np.float64]) -> float:
    """Return the white standard deviation of one reading, deg/s: the median over data sets and frequencies.

    It is NaN for data sets of fewer than 6 readings: they are too short for a spectrum.
    """
    full = (
        presence.all(axis=1)
        if presence.all(axis=1).sum() >= max(8, len(presence) // 10)
        else np.ones(len(presence), dtype=bool)
    )
    chosen, mask = values[full], presence[full]
    middle = (chosen * mask).sum(axis=1, keepdims=True) / np.maximum(mask.sum(axis=1, keepdims=True), 1.0)
    window = np.hanning(chosen.shape[1])[None, :]
    residual = np.where(mask > 0, chosen - middle, 0.0) * window
    power = np.abs(np.fft.rfft(residual, axis=1)[:, 2:-1]) ** 2 / np.sum(window**2)
    if not power.size:
        return float("nan")
    per_set = np.median(power, axis=1) / np.log(2.0)
    return float(np.sqrt(np.median(per_set)))
