"""Which temperature levels a recording has, from the temperatures themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Within this span everything counts as one temperature.
ONE_LEVEL_SPAN_C = 1.0
#: Levels are discrete when the gaps between them are this many times the gaps inside them.
GAP_RATIO = 3.0
BINS = 8


def temperature_levels(temperature_c: Array) -> NDArray[np.int64] | None:
    """Return the level of each data set, (n,) from 0 rising with temperature; None where there are no discrete levels.

    Levels are discrete when sorted temperatures fall into clusters, each narrower than half the distance to its
    neighbours.
    """
    n = len(temperature_c)
    if n == 0 or np.ptp(temperature_c) <= ONE_LEVEL_SPAN_C:
        return np.zeros(n, dtype=np.int64)
    order = np.argsort(temperature_c, kind="stable")
    gaps = np.diff(temperature_c[order])
    ranked = np.sort(gaps)[::-1]
    most = min(len(ranked) - 1, n // 2)
    if most < 1:
        return np.argsort(order).astype(np.int64)
    ratios = ranked[:most] / np.maximum(ranked[1 : most + 1], 1e-3)
    best = int(np.argmax(ratios))
    if ratios[best] < GAP_RATIO:
        return None
    labels_sorted = np.concatenate([[0], np.cumsum(gaps >= ranked[best])])
    labels = np.empty(n, dtype=np.int64)
    labels[order] = labels_sorted
    return labels if _are_apart(temperature_c, labels) else None


def _are_apart(temperature_c: Array, labels: NDArray[np.int64]) -> bool:
    centres = level_means(temperature_c, labels)
    spans = np.array([np.ptp(temperature_c[labels == level]) for level in range(len(centres))])
    return len(centres) > 1 and bool(np.all(spans < 0.5 * np.min(np.diff(centres))))


def level_means(temperature_c: Array, labels: NDArray[np.int64]) -> Array:
    """Return the mean temperature of each level, (m,)."""
    sums = np.bincount(labels, weights=temperature_c)
    return sums / np.bincount(labels)


def folds(temperature_c: Array, *, thermometer: bool = True) -> list[NDArray[np.bool_]]:
    """Return the data sets to leave out together, one mask (n,) per temperature level, rising.

    Without discrete levels: 8 bins of equal count in temperature. Without a thermometer: 8 in order of time.
    """
    if not thermometer:
        n = len(temperature_c)
        return [np.arange(n) * BINS // n == part for part in range(BINS)] if n >= BINS else []
    labels = temperature_levels(temperature_c)
    if labels is None:
        ranks = np.argsort(np.argsort(temperature_c, kind="stable"), kind="stable")
        labels = ranks * BINS // len(temperature_c)
    return [labels == level for level in range(int(labels.max()) + 1)]
