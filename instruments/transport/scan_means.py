"""Means of scans of analog inputs: sums of whole numbers over groups that the scan's own number fixes.

Scan k belongs to reading k // average. A reading of which a scan is missing is not made: it counts as lost, and no mean
of fewer scans stands in its place. The mean is a boxcar: its first zero is at the rate of the readings.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.int64]


class ScanMeans:
    """Sums of `average` consecutive scans; what is left over waits for the next scans."""

    def __init__(self, average: int, inputs: int) -> None:
        self.average, self._inputs = average, inputs
        self.drop()

    def drop(self) -> None:
        """Drop what waits."""
        self._numbers: Counts = np.zeros(0, dtype=np.int64)
        self._codes: Counts = np.zeros((0, self._inputs), dtype=np.int64)
        self._good: NDArray[np.bool_] = np.zeros(0, dtype=bool)

    def add(self, numbers: Counts, codes: Counts, good: NDArray[np.bool_]) -> tuple[Counts, Counts, NDArray[np.bool_]]:
        """Return the complete readings: their numbers (k,), sums of codes (k, inputs), and whether all is good (k,).

        `numbers` (n,) are those of the scans, rising; `codes` (n, inputs); `good` (n,).
        """
        numbers = np.concatenate([self._numbers, numbers])
        codes, good = np.concatenate([self._codes, codes]), np.concatenate([self._good, good])
        groups = numbers // self.average
        last = len(groups) and groups[-1]
        waits = (groups == last) & (numbers[-1:] != (last + 1) * self.average - 1)
        self._numbers, self._codes, self._good = numbers[waits], codes[waits], good[waits]
        groups, codes, good = groups[~waits], codes[~waits], good[~waits]
        group_numbers, starts, counts = np.unique(groups, return_index=True, return_counts=True)
        whole = counts == self.average
        if not len(starts):
            return group_numbers, codes, good
        sums = np.add.reduceat(codes, starts, axis=0)
        return group_numbers[whole], sums[whole], np.logical_and.reduceat(good, starts)[whole]
