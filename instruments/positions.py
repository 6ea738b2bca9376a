"""Positions of a unit on the table: which direction of the body points up, and by how much it is turned about it.

`x` and `-x` are the two ends of an axis. `x+y+z` is a tilted mounting: the sum of these axes, a body diagonal, lies
along the table axis, so that each of the three turns at 1/sqrt(3) of the table's rate; `3x+4z` has other shares.
`x@180` is the same face with the unit turned by 180 deg on the fixture, counter-clockwise seen from above; `x@0/90` is
the fixture, with the unit in it, turned by 90 deg on the table. `zr200` is a unit at 200 mm from the table's axis, and
`zr200x` the same with body axis x pointing away from the axis of the table; without `r` the distance is not known.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import cache

AXES = ("x", "y", "z")
#: So long is the text of a position at most: a database keeps no more.
MAX_LENGTH = 10
#: No unit is mounted further from the axis of a table than this, mm.
MAX_RADIUS_MM = 9999
EXPECTED = (
    "x, -x, y, -y, z or -z; tilted, a sum of body axes such as x+y+z or 3x-4z; with the unit turned on its face x@180, "
    "with the fixture turned on the table x@0/180: whole degrees from 0 to 359; at a known distance from the table's "
    f"axis zr200: 0 to {MAX_RADIUS_MM} mm, then the level body axis that points away from it, zr200x or zr200-y; at "
    f"most {MAX_LENGTH} characters"
)
Vector = tuple[float, float, float]
_TERM = re.compile(r"([+-]?)(\d{0,3})([xyz])")
_FORM = re.compile(r"(-?\d{0,3}[xyz](?:[+-]\d{0,3}[xyz]){0,2})(?:r(\d{1,4})(-?[xyz])?)?(?:@(\d{1,3})(?:/(\d{1,3}))?)?")


@dataclass(frozen=True)
class Position:
    """How a unit is mounted; angles in whole degrees, counter-clockwise seen from above, 0 to 359."""

    shares: tuple[int, int, int]  #: of x, y and z in the direction that points up, in proportion
    unit_deg: int = 0  #: by which the unit is turned on its fixture
    fixture_deg: int = 0  #: by which the fixture is turned on the table, with the unit
    radius_mm: int | None = None  #: distance of the unit from the table's axis; None: not known
    outward: str = ""  #: level body axis that points away from it before a turn on the fixture; empty: not known

    @staticmethod
    @cache
    def of(text: str) -> Position:
        """Return the position that a text names; raises ValueError where it names none."""
        match = _FORM.fullmatch(text)
        shares = _shares(match[1]) if match else None
        if match and shares is not None:
            radius_mm, outward = None if match[2] is None else int(match[2]), match[3] or ""
            position = Position(shares, int(match[4] or 0), int(match[5] or 0), radius_mm, outward)
            if position.is_sound:
                return position
        raise ValueError(f"{text!r} is not a position (expected {EXPECTED})")

    @property
    def is_sound(self) -> bool:
        """Whether angles, outward axis and the length of its text are within their limits."""
        is_level = not self.outward or self.outward.removeprefix("-") not in self.axes
        return is_level and max(self.unit_deg, self.fixture_deg) < 360 and len(str(self)) <= MAX_LENGTH

    @property
    def axes(self) -> tuple[str, ...]:
        """The body axes that turn with the table."""
        return tuple(axis for axis, share in zip(AXES, self.shares, strict=True) if share)

    @property
    def is_tilted(self) -> bool:
        """Whether no body axis lies along the table axis."""
        return len(self.axes) > 1

    @property
    def axis(self) -> str:
        """The body axis along the table axis; empty in a tilted mounting."""
        return "" if self.is_tilted else self.axes[0]

    @property
    def sign(self) -> float:
        """-1 where the other end of the axis points up; in a tilted mounting 1."""
        return -1.0 if not self.is_tilted and sum(self.shares) < 0 else 1.0

    @property
    def up(self) -> Vector:
        """The unit vector along the table axis, upwards, in the frame of the body."""
        if not self.is_tilted:  # exact
            x, y, z = (float(share) for share in self.shares)
            return x, y, z
        size = math.hypot(*self.shares)
        x, y, z = (share / size for share in self.shares)
        return x, y, z

    @property
    def end(self) -> str:
        """What points up: an end of an axis, `x` or `-x`, or a sum of axes."""
        terms = [
            f"{'-' if share < 0 else '+'}{'' if abs(share) == 1 else abs(share)}{axis}"
            for axis, share in zip(AXES, self.shares, strict=True)
            if share
        ]
        return "".join(terms).removeprefix("+")

    @property
    def radius_m(self) -> float | None:
        """Distance of the unit from the table's axis, m; None: not known."""
        return None if self.radius_mm is None else self.radius_mm / 1000.0

    @property
    def outwards(self) -> Vector | None:
        """The unit vector away from the table's axis in the frame of the body; None: not known.

        The direction stays behind when the unit is turned on its fixture; where the fixture is turned, it is not known.
        """
        if not self.outward or self.fixture_deg:
            return None
        sign = -1.0 if self.outward.startswith("-") else 1.0
        x, y, z = (sign * (axis == self.outward[-1]) for axis in AXES)
        angle_rad, (a, b, c) = math.radians(self.unit_deg), self.up
        cos, sin = math.cos(angle_rad), math.sin(angle_rad)
        return cos * x - sin * (b * z - c * y), cos * y - sin * (c * x - a * z), cos * z - sin * (a * y - b * x)

    def at_radius(self, radius_mm: int, outward: str = "") -> Position:
        """Return the same mounting at a distance from the table's axis, as far as its text has room to say it.

        Where the fixture is turned on the table, the distance is not known: the table says how its fixture is mounted.
        """
        if self.fixture_deg:
            return self
        whole = replace(self, radius_mm=radius_mm, outward=outward)
        return next(each for each in (whole, replace(whole, outward=""), self) if each.is_sound)

    @property
    def without_radius(self) -> Position:
        """The same mounting without the distance from the table's axis."""
        return replace(self, radius_mm=None, outward="")

    @property
    def off_axis(self) -> str:
        """The distance from the table's axis in words; empty where it is not known."""
        if self.radius_mm is None:
            return ""
        pointing_text = f", body axis {self.outward} pointing away from it" if self.outward else ""
        before_text = " before that turn" if self.outward and self.unit_deg else ""
        return f"{self.radius_mm} mm from the axis of the table{pointing_text}{before_text}"

    @property
    def turned_deg(self) -> int:
        """By which the unit is turned against the table, deg."""
        return self.unit_deg + self.fixture_deg

    @property
    def upside_down(self) -> Position:
        """The same axis along the table axis, the other end up."""
        x, y, z = self.shares
        return replace(self, shares=(-x, -y, -z))

    @property
    def in_words(self) -> str:
        """The position in words: which axis points up, and what is turned by how much."""
        turns_text = [
            f"the {role} turned by {angle} deg"
            for role, angle in (("unit", self.unit_deg), ("fixture", self.fixture_deg))
            if angle
        ]
        tilted = ["tilted: body direction"] if self.is_tilted else []
        off_axis = [self.off_axis] if self.off_axis else []
        return ", ".join([" ".join([*tilted, f"{self.end} up"]), *turns_text, *off_axis])

    def __str__(self) -> str:
        mounted = self.end if self.radius_mm is None else f"{self.end}r{self.radius_mm}{self.outward}"
        if self.fixture_deg:
            return f"{mounted}@{self.unit_deg}/{self.fixture_deg}"
        return f"{mounted}@{self.unit_deg}" if self.unit_deg else mounted


def _shares(text: str) -> tuple[int, int, int] | None:
    """Return the shares of x, y and z in lowest terms; None where an axis is there twice, or with a share of 0."""
    shares = dict.fromkeys(AXES, 0)
    for sign, size, axis in _TERM.findall(text):
        if shares[axis] or size.strip("0") == "" != size:
            return None
        shares[axis] = (-1 if sign == "-" else 1) * int(size or 1)
    divisor = math.gcd(*shares.values())
    x, y, z = (share // divisor for share in shares.values())
    return x, y, z
