"""Control lines of a simulator in another process: mount the units, switch their power. One line, one reply line."""

from __future__ import annotations

OK = "ok"
MOUNT, POWER = "mount", "power"


def mount_line(position: str) -> str:
    """Return the line that mounts the units with body axis `position` up along the table axis."""
    return f"{MOUNT} {position}"


def power_line(on: bool) -> str:
    """Return the line that switches the power of the units."""
    return f"{POWER} {'on' if on else 'off'}"
