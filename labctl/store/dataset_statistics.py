"""What a data set's readings come to: mean, standard deviation, white level, number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.recording.spread import LEAST_FOR_SPECTRUM, white_std


@dataclass(frozen=True)
class Statistics:
    """Figures of one channel in one data set, in the channel's unit."""

    mean: float | None
    std: float | None
    white_std: float | None
    n: int


def statistics(values: NDArray[np.float64], *, spectrum: bool) -> Statistics:
    """Return the figures of valid readings (n,); the white level only with `spectrum`."""
    n = len(values)
    if n == 0:
        return Statistics(None, None, None, 0)
    return Statistics(
        float(values.mean()),
        float(values.std(ddof=1)) if n > 1 else None,
        white_std(values) if spectrum and n >= LEAST_FOR_SPECTRUM else None,
        n,
    )
