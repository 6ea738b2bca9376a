"""Positions of a unit on the table: which body axis points up, and by how much unit and fixture are turned about it.

`x` and `-x` are the two ends of an axis. `x@180` is the same face with the unit turned by 180 deg on the fixture,
counter-clockwise seen from above; `x@0/90` is the fixture, with the unit in it, turned by 90 deg on the table.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cache

AXES = ("x", "y", "z")
EXPECTED = (
    "x, -x, y, -y, z or -z; with the unit turned on its face x@180, with the fixture turned on the table x@0/180: "
    "whole degrees from 0 to 359"
)
_FORM = re.compile(r"(-?)([xyz])(?:@(\d{1,3})(?:/(\d{1,3}))?)?")


@dataclass(frozen=True)
class Position:
    """How a unit is mounted; angles in whole degrees, counter-clockwise seen from above, 0 to 359."""

    axis: str  #: the body axis along the table axis
    sign: float = 1.0  #: -1: its other end points up
    unit_deg: int = 0  #: by which the unit is turned on its fixture
    fixture_deg: int = 0  #: by which the fixture is turned on the table, with the unit

    @staticmethod
    @cache
    def of(text: str) -> Position:
        """Return the position that a text names; raises ValueError where it names none."""
        match = _FORM.fullmatch(text)
        angles_deg = tuple(int(group or 0) for group in match.groups()[2:]) if match else (0, 0)
        if match is None or max(angles_deg) >= 360:
            raise ValueError(f"{text!r} is not a position (expected {EXPECTED})")
        return Position(match[2], -1.0 if match[1] else 1.0, *angles_deg)

    @property
    def end(self) -> str:
        """Which end of which axis points up: `x` or `-x`."""
        return f"{'-' if self.sign < 0 else ''}{self.axis}"

    @property
    def turned_deg(self) -> int:
        """By which the unit is turned against the table, deg."""
        return self.unit_deg + self.fixture_deg

    @property
    def upside_down(self) -> Position:
        """The same axis along the table axis, the other end up."""
        return replace(self, sign=-self.sign)

    @property
    def in_words(self) -> str:
        """The position in words: which axis points up, and what is turned by how much."""
        turns_text = [
            f"the {role} turned by {angle} deg"
            for role, angle in (("unit", self.unit_deg), ("fixture", self.fixture_deg))
            if angle
        ]
        return ", ".join([f"{self.end} up", *turns_text])

    def __str__(self) -> str:
        if self.fixture_deg:
            return f"{self.end}@{self.unit_deg}/{self.fixture_deg}"
        return f"{self.end}@{self.unit_deg}" if self.unit_deg else self.end
