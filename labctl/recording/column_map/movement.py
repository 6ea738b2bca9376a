"""When a unit was still and when it moved, by its own gyro; and in how many poses it rested."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labctl.recording.sanity.readings.series import code_step

Array = NDArray[np.float64]

#: Readings are judged in windows of about this time, s, and of at least so many readings.
WINDOW_S, MIN_READINGS = 0.5, 8
#: Noise that a gyro at rest may have, deg/s: what is above is taken for movement also where all of a log has it.
MAX_NOISE_DPS = 0.5
#: A window moves where its spread is beyond so many times the usual, and beyond this, deg/s.
TIMES_USUAL, MIN_SPREAD_DPS = 5.0, 0.1
#: The output of a still unit may differ this much from its usual value by temperature, deg/s.
MAX_DRIFT_DPS = 5.0
#: A unit that moves in more than this share of its windows was moved; less are knocks.
KNOCKS = 0.02
#: A rest lasts at least so long, s; two poses differ by at least this angle, deg.
SHORTEST_REST_S, POSE_DEG = 1.0, 15.0


@dataclass(frozen=True)
class Movement:
    """`still` says of each reading whether the unit was still, (n,); `share` is the share of time in which it moved."""

    still: NDArray[np.bool_]
    share: float
    spread_dps: float  #: largest spread of the output over the log, of any axis

    @property
    def is_rest(self) -> bool:
        """Whether the unit rested, apart from knocks."""
        return self.share <= KNOCKS


def movement(rates_dps: Array, t_s: Array) -> Movement:
    """Return when a unit moved, from its output (n, axes) in deg/s and the times (n,)."""
    n = len(t_s)
    rates_dps = np.nan_to_num(rates_dps)
    step = float(np.median(np.diff(t_s))) if n > 1 else 1.0
    size = int(min(max(round(WINDOW_S / max(step, 1e-9)), MIN_READINGS), n))
    starts = np.arange(0, n, size)
    counts = np.diff(np.append(starts, n))
    means = np.add.reduceat(rates_dps, starts, axis=0) / counts[:, None]
    centred = rates_dps - np.repeat(means, counts, axis=0)
    spread = np.sqrt(np.add.reduceat(centred**2, starts, axis=0) / counts[:, None])
    usual = np.minimum(np.percentile(spread, 20, axis=0), MAX_NOISE_DPS)
    steps = [code_step(column) for column in rates_dps.T]  # a still output that lies between two codes spreads by one
    moves = (spread > np.maximum(TIMES_USUAL * usual, np.maximum(MIN_SPREAD_DPS, steps))).any(axis=1)
    if not moves.all():
        quiet = means[~moves]
        slowest = np.argsort(np.linalg.norm(quiet, axis=1))[: max(1, len(quiet) // 2)]
        level = np.median(quiet[slowest], axis=0)  # also where a steady turn lasts as long as the rests do
        moves |= (np.abs(means - level) > MAX_DRIFT_DPS).any(axis=1)
    still = np.repeat(~moves, counts)
    low, high = np.percentile(rates_dps, [0.1, 99.9], axis=0)
    return Movement(still, float(np.average(moves, weights=counts)), float((high - low).max()))


def stretches(is_same: NDArray[np.bool_]) -> list[tuple[int, int, bool]]:
    """Return runs of equal values as (first row, row after the last, value), rows from 0."""
    edges = np.flatnonzero(np.concatenate([[True], is_same[1:] != is_same[:-1], [True]]))
    return [(int(a), int(b), bool(is_same[a])) for a, b in pairwise(edges)]


def rests(log_movement: Movement, t_s: Array) -> list[tuple[int, int]]:
    """Return the rests that last long enough, as (first row, row after the last)."""
    runs = stretches(log_movement.still)
    return [(a, b) for a, b, still in runs if still and t_s[b - 1] - t_s[a] >= SHORTEST_REST_S]


def poses(log_movement: Movement, t_s: Array, accel_g: Array) -> int:
    """Return in how many poses that gravity distinguishes the unit rested, from the specific force (n, 3)."""
    directions: list[Array] = []
    for a, b in rests(log_movement, t_s):
        mean = np.nanmean(accel_g[a:b], axis=0)
        size = float(np.linalg.norm(mean))
        if size == 0 or not np.isfinite(size):
            continue
        unit = mean / size
        if all(float(unit @ other) < np.cos(np.radians(POSE_DEG)) for other in directions):
            directions.append(unit)
    return len(directions)
