"""Rates and specific force in body axes: the turning table, the rotation of the Earth, and gravity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from instruments.positions import Position, Vector

Array = NDArray[np.float64]
#: One sidereal turn, deg/s.
EARTH_DPS = 360.0 / 86164.0905


@dataclass(frozen=True)
class BodyFrame:
    """Orientation of the units: body axis along the table axis, the two level axes in cyclic order, and the sign.

    In a tilted mounting `rows` are the body's components of three directions of the bench that stand for these axes:
    `first`, `second` and `up`.
    """

    up: int
    first: int
    second: int
    sign: float
    turned_deg: float = 0.0  #: of the units against the table, counter-clockwise seen from above
    rows: tuple[Vector, ...] = ()  #: empty where a body axis lies along the table axis

    @classmethod
    @cache
    def of(cls, position: Position) -> BodyFrame:
        """Return the frame of a mounting position."""
        if position.is_tilted:
            return cls(2, 0, 1, 1.0, float(position.turned_deg), _level_and_up(np.array(position.up)))
        up = "xyz".index(position.axis)
        return cls(up, (up + 1) % 3, (up + 2) % 3, position.sign, float(position.turned_deg))

    def gravity(self, n: int) -> Array:
        """Return the specific force in body axes, (n, 3) g: one g up."""
        g = np.zeros((n, 3))
        g[:, self.up] = self.sign
        return self.in_body(g)

    def outwards(self) -> Array:
        """Return the direction (3,) along `first`, `second` and `up` that points away from the axis if none is stated.

        The first level axis, of a unit that is not turned on its fixture; a turn leaves it behind.
        """
        angle = self.sign * np.radians(self.turned_deg)
        direction = np.zeros(3)
        direction[self.first], direction[self.second] = np.cos(angle), -np.sin(angle)
        return direction

    def in_body(self, vectors: Array) -> Array:
        """Return vectors (n, 3) along `first`, `second` and `up` of a tilted mounting in body axes; others as given."""
        return vectors @ np.array(self.rows) if self.rows else vectors


def _level_and_up(up: Array) -> tuple[Vector, ...]:
    """Return two level directions and the direction up in body axes; right-handed, the first nearest to a body axis."""
    nearest = np.zeros(3)
    nearest[int(np.argmin(np.abs(up)))] = 1.0
    first = nearest - (nearest @ up) * up
    first /= np.linalg.norm(first)
    x, y, z = (tuple(each.tolist()) for each in (first, np.cross(up, first), up))
    return x, y, z


@dataclass(frozen=True)
class EarthRotation:
    """Rotation of the Earth at a latitude (None leaves it out); `north_deg` is the table angle of north."""

    latitude_deg: float | None
    north_deg: float

    @property
    def laboratory_dps(self) -> Array:
        """The rotation of the Earth, (3,) deg/s: two level directions, and up."""
        if self.latitude_deg is None:
            return np.zeros(3)
        latitude, heading = np.radians(self.latitude_deg), np.radians(self.north_deg)
        level = EARTH_DPS * np.cos(latitude)
        return np.array([level * np.cos(heading), level * np.sin(heading), EARTH_DPS * np.sin(latitude)])

    def body_rates(self, frame: BodyFrame, table_dps: Array, angle_deg: Array) -> Array:
        """Return the inertial rate along the axes of a frame, (n, 3) deg/s, at table rates and table angles (n,)."""
        rates = np.zeros((len(table_dps), 3))
        rates[:, frame.up] = frame.sign * table_dps
        if self.latitude_deg is not None:
            latitude = np.radians(self.latitude_deg)
            rates[:, frame.up] += frame.sign * EARTH_DPS * np.sin(latitude)
            heading = np.radians(angle_deg + frame.turned_deg - self.north_deg)
            level = EARTH_DPS * np.cos(latitude)
            rates[:, frame.first] += level * np.cos(heading)
            rates[:, frame.second] -= frame.sign * level * np.sin(heading)
        return rates
