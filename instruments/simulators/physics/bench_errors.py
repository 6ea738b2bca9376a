"""True errors of a simulated bench, drawn from the distributions that its reference standards state."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from instruments.positions import AXES, Position
from instruments.simulators.physics.body_kinematics import BodyFrame
from instruments.standards import Standard

Array = NDArray[np.float64]
#: Two angles, rad: of a direction against the vertical, towards the next two body axes in cyclic order.
Lean = tuple[float, float]
UPRIGHT: Lean = (0.0, 0.0)


@dataclass(frozen=True)
class BenchErrors:
    """Errors of one bench, indicated minus true. A bench whose standards are not drawn from is exact.

    The axis of rotation leans in the frame of a unit by three angles: the fixture's, of each face of its own, which
    stays behind when the unit is turned on the face; the table top's, which stays behind when the fixture is turned
    too; and that of the single mounting, drawn anew whenever the unit is mounted.
    """

    rate: float = 0.0  #: relative, of the table's rate
    air_c: float = 0.0  #: of the chamber's thermometer at the units, K
    level_deg: float = 0.0  #: by which the axis of rotation leans to the north
    fixture_rad: Mapping[str, Lean] = field(default_factory=dict)  #: the end that points up -> of its face
    table_rad: Lean = UPRIGHT
    remounted: tuple[Standard, ...] = ()  #: what each mounting is drawn from
    tilted: tuple[Standard, ...] = ()  #: what the tilted fixture is drawn from, of each direction of its own
    seed: tuple[int, ...] = field(default=(), compare=False)
    radius_m: float = 0.0  #: of the distance of the units from the axis of the table

    @staticmethod
    def drawn(standards: Sequence[Standard], seed: Sequence[int]) -> BenchErrors:
        """Return errors drawn from what the standards state; what none states is exact."""
        rng = np.random.default_rng([*seed, zlib.crc32(b"standards")])
        below = np.random.default_rng([*seed, zlib.crc32(b"opposite faces")])
        of = {
            quantity: _summed(standards, quantity, rng)
            for quantity in ("thermometer", "chamber_gradient", "fixture_angle", "tilt", "level")
        }
        table = sum(float(_drawn(standard, rng)[0]) for standard in standards if standard.unit_name == "ppm")
        faces = np.radians(np.concatenate([of["fixture_angle"], _summed(standards, "fixture_angle", below)]))
        ends = [f"{sign}{axis}" for sign in ("", "-") for axis in AXES]
        return BenchErrors(
            1e-6 * table,
            float(of["thermometer"][0] + of["chamber_gradient"][0]),
            float(of["level"][0]),
            {end: _lean(two) for end, two in zip(ends, faces.reshape(6, 2), strict=True)} if np.any(faces) else {},
            _lean(np.radians(of["tilt"][:2])),
            tuple(standard for standard in standards if standard.quantity == "mounting_repeatability"),
            tuple(standard for standard in standards if standard.quantity == "tilted_fixture_angle"),
            tuple(seed),
            float(_summed(standards, "radius", np.random.default_rng([*seed, zlib.crc32(b"radius")]))[0]),
        )

    def lean_rad(self, position: Position, mounting: int) -> Lean:
        """Return by how much the axis of rotation leans in the frame of a unit in its mounting of a number, rad."""
        faces = _turned(self._of_face(position), position.unit_deg, position.sign)
        top = self.table_rad[0], position.sign * self.table_rad[1]  # upside down, the second axis lies the other way
        table = _turned(top, position.turned_deg, position.sign)
        rng = np.random.default_rng([*self.seed, zlib.crc32(b"mountings"), mounting])
        mounted = np.radians(_summed(self.remounted, "mounting_repeatability", rng))
        return faces[0] + table[0] + float(mounted[0]), faces[1] + table[1] + float(mounted[1])

    def _of_face(self, position: Position) -> Lean:
        """Return by how much the face of the fixture below a unit leans, rad."""
        if not position.is_tilted:
            return self.fixture_rad.get(position.end, UPRIGHT)
        rng = np.random.default_rng([*self.seed, zlib.crc32(b"tilted fixture"), zlib.crc32(position.end.encode())])
        return _lean(np.radians(_summed(self.tilted, "tilted_fixture_angle", rng)[:2]))


def felt(rates: Array, frame: BodyFrame, lean_rad: Lean) -> Array:
    """Return the rates (n, 3) about the axes of a unit, deg/s, against which the axis of rotation leans."""
    if lean_rad == UPRIGHT:
        return rates
    leaned = _rotated(rates, frame.up, frame.first, frame.sign * lean_rad[0])
    return _rotated(leaned, frame.up, frame.second, frame.sign * lean_rad[1])


def _turned(lean_rad: Lean, turned_deg: int, sign: float) -> Lean:
    """Return a lean that is fixed below a unit in the frame of the unit, which is turned by an angle above it."""
    angle_rad = sign * math.radians(turned_deg)
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    return cos * lean_rad[0] + sin * lean_rad[1], cos * lean_rad[1] - sin * lean_rad[0]


def _lean(two: Array) -> Lean:
    return float(two[0]), float(two[1])


def _rotated(rates: Array, axis: int, other: int, angle_rad: float) -> Array:
    """Return rates (n, 3) in axes that are turned by an angle in the plane of two of them."""
    rotated = rates.copy()
    rotated[:, axis] = np.cos(angle_rad) * rates[:, axis] - np.sin(angle_rad) * rates[:, other]
    rotated[:, other] = np.sin(angle_rad) * rates[:, axis] + np.cos(angle_rad) * rates[:, other]
    return rotated


def _summed(standards: Sequence[Standard], quantity: str, rng: np.random.Generator) -> Array:
    """Return six errors of a quantity, the sums of what its standards state, in its unit."""
    return sum((_drawn(standard, rng) for standard in standards if standard.quantity == quantity), np.zeros(6))


def _drawn(standard: Standard, rng: np.random.Generator) -> Array:
    """Return six errors from the distribution that a standard states, in its unit."""
    width = standard.half_width
    if width is None:
        return rng.normal(0.0, standard.standard_u, 6)
    if standard.distribution == "triangular":
        return rng.triangular(-width, 0.0, width, 6) if width else np.zeros(6)
    if standard.distribution == "u-shaped":
        return np.asarray(width * np.sin(rng.uniform(-math.pi, math.pi, 6)))
    return rng.uniform(-width, width, 6)
