"""Positions of a unit on the table: which direction of the body points up, and by how much it is turned about it.

`x` and `-x` are the two ends of an axis. `x+y+z` is a tilted mounting: the sum of these axes, a body diagonal, lies
along the table axis, so that each of the three turns at 1/sqrt(3) of the table's rate; `3x+4z` has other shares.
`x@180` is the same face with the unit turned by 180 deg on the fixture, counter-clockwise seen from above; `x@0/90` is
the fixture, with the unit in it, turned by 90 deg on the table.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import cache

AXES = ("x", "y", "z")
#: So long is the text of a position at most: a database keeps no more.
MAX_LENGTH = 10
EXPECTED = (
    "x, -x, y, -y, z or -z; tilted, a sum of body axes such as x+y+z or 3x-4z; with the unit turned on its face x@180, "
    f"with the fixture turned on the table x@0/180: whole degrees from 0 to 359; at most {MAX_LENGTH} characters"
)
Vector = tuple[float, float, float]
_TERM = re.compile(r"([+-]?)(\d{0,3})([xyz])")
_FORM = re.compile(r"(-?\d{0,3}[xyz](?:[+-]\d{0,3}[xyz]){0,2})(?:@(\d{1,3})(?:/(\d{1,3}))?)?")


@dataclass(frozen=True)
class Position:
    """How a unit is mounted; angles in whole degrees, counter-clockwise seen from above, 0 to 359."""

    shares: tuple[int, int, int]  #: of x, y and z in the direction that points up, in proportion
    unit_deg: int = 0  #: by which the unit is turned on its fixture
    fixture_deg: int = 0  #: by which the fixture is turned on the table, with the unit

    @staticmethod
    @cache
    def of(text: str) -> Position:
        """Return the position that a text names; raises ValueError where it names none."""
        match = _FORM.fullmatch(text)
        angles_deg = tuple(int(group or 0) for group in match.groups()[1:]) if match else (0, 0)
        shares = _shares(match[1]) if match else None
        if shares is not None and max(angles_deg) < 360:
            position = Position(shares, *angles_deg)
            if len(str(position)) <= MAX_LENGTH:
                return position
        raise ValueError(f"{text!r} is not a position (expected {EXPECTED})")

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
        return ", ".join([" ".join([*tilted, f"{self.end} up"]), *turns_text])

    def __str__(self) -> str:
        if self.fixture_deg:
            return f"{self.end}@{self.unit_deg}/{self.fixture_deg}"
        return f"{self.end}@{self.unit_deg}" if self.unit_deg else self.end


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
