"""Readings of data sets of unequal length as rectangular arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.recording.info import Motion
from labctl.recording.points import dataset_starts, pieces

#: A data set longer than this many median ones is taken in pieces.
LONGEST = 4


@dataclass(frozen=True)
class Padded:
    """Readings as (m, n), n those of the longest data set, with zeros where there is none."""

    there: NDArray[np.float64]  #: (m, n) 1 where there is a reading
    index: NDArray[np.int64]  #: (m, n) its row

    def of(self, values: Array) -> NDArray[np.float64]:
        """Return a column (rows,) as (m, n)."""
        return np.where(self.there > 0, values[self.index], 0.0)


def pad(dataset: NDArray[np.int64]) -> Padded:
    """Return m data sets side by side, of labels (rows,) that change with the data set."""
    starts = dataset_starts(dataset)
    counts = np.diff(np.append(starts, len(dataset)))
    offset = np.arange(int(counts.max()))
    there = offset[None, :] < counts[:, None]
    return Padded(there.astype(np.float64), np.where(there, starts[:, None] + offset, 0))


def piece_labels(columns: Mapping[str, NDArray[np.generic]], motion: Motion = "rates") -> NDArray[np.int64]:
    """Return labels (n,) that change with the row of the fit, and within one that is far longer than the median.

    A static record at one temperature is one row of the fit. In a rectangular array it would need memory, and its
    single mean would hide the drift within it.
    """
    rows = pieces(columns, motion)
    starts = dataset_starts(rows)
    counts = np.diff(np.append(starts, len(rows)))
    parts = -(-counts // max(int(LONGEST * np.median(counts)), 1))
    ordinal = np.arange(len(rows)) - np.repeat(starts, counts)
    first = np.concatenate([[0], np.cumsum(parts)[:-1]])
    return np.repeat(first, counts) + ordinal * np.repeat(parts, counts) // np.repeat(counts, counts)
