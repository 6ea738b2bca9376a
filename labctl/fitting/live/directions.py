"""Poses of a body, named by the body axes that point up: faces, edges and corners of a cube."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: A rest covers a pose where gravity is closer to it than this, deg: less than half of what edges and corners differ by
#: (35 deg), so that no rest covers two.
NEAR_DEG = 17.0


@dataclass(frozen=True)
class Direction:
    """A pose: the direction in the body that points up."""

    name: str  #: the axes that point up, such as "z", "x,-z" or "x,y,-z"
    up: tuple[float, float, float]  #: of length 1

    @property
    def text(self) -> str:
        """The pose in words."""
        axes = self.name.split(",")
        if len(axes) == 1:
            return f"body axis {axes[0]} pointing up"
        named = f"{', '.join(axes[:-1])} and {axes[-1]}"
        return f"body axes {named} pointing up equally, on {'an edge' if len(axes) == 2 else 'a corner'}"


def _of(signs: tuple[int, ...]) -> Direction:
    name = ",".join(f"{'-' if sign < 0 else ''}{axis}" for axis, sign in zip("xyz", signs, strict=True) if sign)
    size = float(np.sqrt(sum(abs(sign) for sign in signs)))
    return Direction(name, (signs[0] / size, signs[1] / size, signs[2] / size))


#: Faces first, then edges, then corners.
DIRECTIONS: tuple[Direction, ...] = tuple(
    _of(signs)
    for several in (1, 2, 3)
    for signs in product((0, 1, -1), repeat=3)
    if sum(abs(sign) for sign in signs) == several
)


def covered(up: NDArray[np.float64]) -> tuple[bool, ...]:
    """Return which of DIRECTIONS rests whose specific forces point to `up` (k, 3), of length 1, cover."""
    limit = float(np.cos(np.radians(NEAR_DEG)))
    return tuple(bool(np.any(up @ np.array(each.up) > limit)) for each in DIRECTIONS)


def turn_between(before: Array, after: Array) -> tuple[Array, float]:
    """Return the shortest turn from one direction (3,) to another: its axis (3,) in the body, and its angle, deg.

    Between opposite directions, and from a direction to itself, every level axis would do: the axis is 0.
    """
    axis = np.cross(before, after)
    size = float(np.linalg.norm(axis))
    angle_deg = float(np.degrees(np.arctan2(size, float(before @ after))))
    return (axis / size if size > 1e-6 else np.zeros(3)), angle_deg
