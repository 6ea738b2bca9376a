"""Which pose to ask for next: one that is missing, by a turn about the axis of which least is known."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.live.directions import DIRECTIONS, Direction, turn_between
from labctl.fitting.numeric.arrays import Array

#: A turn from 60 to 150 deg changes gravity's direction most surely; further, the path of a hand is any.
GOOD_TURN_DEG = (60.0, 150.0)
#: What a turn outside of that range is worth beside one inside.
OTHER_TURN = 0.3


def next_pose(covered: tuple[bool, ...], wanted: int, here: Array | None, needs: Array) -> Direction:
    """Return the pose to ask for; `covered` says of each of DIRECTIONS whether a rest covers it.

    `here` (3,) is gravity's direction in the last rest, None before the first; `needs` (3,) how much a turn about each
    body axis would add. While some of the first `wanted` poses are missing it is one of them, else any.
    """
    missing = [place for place in range(wanted) if not covered[place]]
    places = missing or list(range(len(DIRECTIONS)))
    if here is None:
        return DIRECTIONS[places[0]]
    worth = [_worth(here, np.array(DIRECTIONS[place].up), needs) for place in places]
    return DIRECTIONS[places[int(np.argmax(worth))]]


def _worth(here: Array, there: Array, needs: Array) -> float:
    axis, angle_deg = turn_between(here, there)
    shared = float(np.sum(axis**2 * needs))
    low, high = GOOD_TURN_DEG
    return shared * (1.0 if low <= angle_deg <= high else OTHER_TURN) * min(angle_deg, 90.0)


def needs_of_turns(up: NDArray[np.float64]) -> Array:
    """Return how much a turn about each axis would add, (3,), before any fit: by the turns between rests (k, 3) so far.

    An axis about which the unit has not turned yet comes first.
    """
    turned = np.zeros(3)
    for before, after in pairwise(up):
        axis, angle_deg = turn_between(before, after)
        turned += axis**2 * angle_deg
    return np.asarray(1.0 / (turned + 90.0))
