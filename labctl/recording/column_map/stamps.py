"""Stamps that are not the times of the readings: coarser than these, such as whole seconds, or of their arrival.

Readings that share a stamp are put between the stamps; readings that arrived in packets are put at their one rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
#: Whole intervals between stamps that are needed to see how many readings each has.
MIN_INTERVALS = 3
#: Readings of one interval may differ from those of another by one, or by this share.
EVEN_WITHIN = 0.02
#: A packet begins after a step of so many usual ones; so many packets, which have most of the time between them, tell.
LONG_STEP, MIN_PACKETS, MAX_BETWEEN = 2.5, 400, 0.5
#: The readings of packets are of one rate where number and time run apart by less than this share of a random walk of
#: the same steps (range of a Brownian bridge: Kuiper 1960; below 0.4 with a probability under 1e-6), ...
OF_RANDOM_WALK = 0.4
#: ... and where packets differ by this share of their mean: equal ones may be of a logger that sleeps between them.
UNEQUAL = 0.2


@dataclass(frozen=True)
class InterpolatedTimes:
    """Times of readings, (n,) s, between coarse stamps, and what was done, in words."""

    t_s: Array
    said: str


def interpolate_between_stamps(t_s: Array) -> InterpolatedTimes | str | None:
    """Return the times of readings that several of a stamp share; None where no two of a row share one.

    In words why it cannot be done, where stamps do not follow each other evenly or have unequal numbers of readings.
    """
    steps = np.diff(t_s)
    if len(steps) == 0 or not np.isfinite(steps).all() or (steps < 0).any() or (steps > 0).mean() > 0.5:
        return None
    edges = np.flatnonzero(steps > 0) + 1  # the first reading of each stamp but the first
    if len(edges) <= MIN_INTERVALS:
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
    interpolated_s = stamps[0] + (np.arange(len(t_s)) - edges[0]) / rate
    return InterpolatedTimes(
        interpolated_s,
        f"times between stamps {apart:g} s apart are interpolated: {rate:.6g} readings a second, at one rate",
    )


def interpolate_in_packets(t_s: Array) -> InterpolatedTimes | None:
    """Return the times of readings whose stamps, (n,) s, are of their arrival in packets; None of other stamps.

    A link or an operating system hands over what a device measured at one rate in packets of any size: few steps are
    long and the others short, but a late packet is as large as it is late, so that the number of readings keeps up
    with the time. Where readings were lost, or a logger slept, it does not.
    """
    steps = np.diff(t_s)
    if len(steps) < MIN_PACKETS or not np.isfinite(steps).all() or (steps <= 0).any():
        return None
    long = steps > LONG_STEP * float(np.median(steps))
    begin = np.flatnonzero(long) + 1  # the first reading of each packet but the first
    span_s = float(t_s[-1] - t_s[0])
    if len(begin) < MIN_PACKETS or float(steps[long].sum()) < MAX_BETWEEN * span_s:
        return None
    stamps = t_s[begin]
    period_s = float((stamps[-1] - stamps[0]) / (begin[-1] - begin[0]))
    late_s = np.diff(stamps) - period_s * np.diff(begin)
    scatter_s = float(np.std(late_s))
    apart_s = float(np.ptp(np.cumsum(late_s)))
    if scatter_s < UNEQUAL * span_s / len(begin) or apart_s > OF_RANDOM_WALK * scatter_s * np.sqrt(len(late_s)):
        return None
    return InterpolatedTimes(
        t_s[0] + np.arange(len(t_s)) * period_s,
        f"the stamps are of the arrival of packets, up to {float(steps.max()):.2g} s apart: the readings were put at "
        f"their one rate, {1.0 / period_s:.6g} readings a second",
    )
