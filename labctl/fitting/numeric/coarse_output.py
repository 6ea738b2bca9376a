"""Whether the steps of an output are larger than its noise, so that a record shows the steps and hides the noise.

With a standard deviation of half a step or more in front of the converter, rounding adds step^2 / 12 and nothing else
(Widrow and Kollar, Quantization Noise, 2008). With less, the readings stay in one code or jump between two: they then
scatter by less or by more than the noise does, as the mean lies within a code or between two.
"""

from __future__ import annotations

import numpy as np

from labctl.fitting.numeric.arrays import Array

#: A record is read in this many blocks of this many readings.
BLOCKS, BLOCK = 200, 256
#: Readings outside the two commonest codes of a block: Gaussian noise of 0.3 steps about a code has this share.
OUTSIDE_SHARE = 0.05


def hiding_step(readings: Array) -> float | None:
    """Return the step of readings (n,), in their unit, where it hides their noise; None where it does not."""
    size = min(BLOCK, len(readings))
    starts = np.unique(np.linspace(0, len(readings) - size, BLOCKS).astype(np.int64))
    outside, step = [], np.inf
    for start in starts:
        codes, counts = np.unique(readings[start : start + size], return_counts=True)
        outside.append(1.0 - float(np.sort(counts)[-2:].sum()) / size)
        if len(codes) > 1:
            step = min(step, float(np.diff(codes).min()))
    if not np.mean(outside) < OUTSIDE_SHARE:
        return None
    if np.isfinite(step):
        return step
    codes = np.unique(readings)  # no block has two codes
    return float(np.diff(codes).min()) if len(codes) > 1 else None
