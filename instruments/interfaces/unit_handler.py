"""Mounting and power of the units under calibration."""

from __future__ import annotations

from typing import Protocol


class UnitHandler(Protocol):
    """A person or a device that turns the units and switches their power. Every failure is an InstrumentError."""

    def mount(self, position: str) -> None:
        """Turn the units so that body axis `position` (x, -x, y ..., tilted x+y+z) points up along the table axis."""
        ...

    def turn(self, position: str, turn_deg: float) -> None:
        """Have the units turned by hand, by `turn_deg` about body axis `position`, which points up.

        Positive is counter-clockwise seen from above. Returns at once, while the units turn.
        """
        ...

    def is_turning(self) -> bool:
        """Get whether a turn by hand is still under way."""
        ...

    def power(self, on: bool) -> None:
        """Switch the power of the units on or off."""
        ...
