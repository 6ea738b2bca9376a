"""Stamps coarser than the readings, such as whole seconds: readings that share a stamp are put between the stamps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Whole intervals between stamps that are needed to see how many readings each has.
LEAST_INTERVALS = 3
#: Readings of one interval may differ from those of another by one, or by this share.
EVEN_WITHIN = 0.02


@dataclass(frozen=True)
class Spread:
    """Times of readings, (n,) s, between coarse stamps, and what was done, in words."""

    t_s: Array
    said: str


def spread_between(t_s: Array) -> Spread | str | None:
    """Return the times of readings that several of a stamp share; None where no two of a row share one.

    In words why it cannot be done, where stamps do not follow each other evenly or have unequal numbers of readings.
    """
    steps = np.diff(t_s)
    if len(steps) == 0 or not np.isfinite(steps).all() or (steps < 0).any() or (steps > 0).mean() > 0.5:
        return None
    edges = np.flatnonzero(steps > 0) + 1  # the first reading of each stamp but the first
    if len(edges) <= LEAST_INTERVALS:
        return None
    counts, stamps = np.diff(edges), t_s[edges]
    apart = float(np.median(np.diff(stamps)))
    most = max(1.0, EVEN_WITHIN * float(counts.max()))
    even = bool(np.allclose(np.diff(stamps), apart, rtol=1e-3)) and counts.max() - counts.min() <= most
    if not even or counts.min() < 2:
        return (
            f"{counts.min()} to {counts.max()} readings share a stamp, so that their times are not known; if they were "
            "taken at one rate, leave the column out of the map and write sample_rate_hz = readings per second"
        )
    rate = (edges[-1] - edges[0]) / (stamps[-1] - stamps[0])
    found = stamps[0] + (np.arange(len(t_s)) - edges[0]) / rate
    return Spread(
        found,
        f"times between stamps {apart:g} s apart are interpolated: {rate:.6g} readings a second, at one rate",
    )
