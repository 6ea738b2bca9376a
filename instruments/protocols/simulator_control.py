"""Control lines of a simulator in another process: mount, turn and switch the units. One line, one reply line."""

from __future__ import annotations

OK, BUSY = "ok", "busy"  #: `busy` answers `is_turning` alone
MOUNT, POWER, TURN, IS_TURNING = "mount", "power", "turn", "is_turning"


def mount_line(position: str) -> str:
    """Return the line that mounts the units with body axis `position` up along the table axis."""
    return f"{MOUNT} {position}"


def power_line(on: bool) -> str:
    """Return the line that switches the power of the units."""
    return f"{POWER} {'on' if on else 'off'}"


def turn_line(position: str, turn_deg: float) -> str:
    """Return the line that has the units turned by hand by an angle, deg, about the axis `position`, which is up."""
    return f"{TURN} {position} {turn_deg!r}"


def turn_of(argument: str) -> tuple[str, float]:
    """Return position and angle, deg, of the line that has the units turned; raises ValueError."""
    position, _, turn_deg = argument.partition(" ")
    return position, float(turn_deg)
