"""Why a serial port cannot be opened, and the command that corrects it."""

from __future__ import annotations

import errno
from pathlib import Path

#: Folder in which Linux names serial ports by their USB adapters.
BY_ID = Path("/dev/serial/by-id")


def remedy(url: str, error: Exception) -> str:
    """Return what to check of a port that cannot be opened."""
    number = getattr(error, "errno", None)
    if number == errno.EACCES:
        return "that this user may use it: run `sudo usermod -aG dialout $USER`, then log in again"
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        return f"which other process has it open: run `fuser -v {url}`, and end that one"
    if number == errno.ENOENT:
        there = sorted(str(path) for path in BY_ID.glob("*")) if BY_ID.is_dir() else []
        found = f"; there are {', '.join(there)}" if there else f"; `ls {BY_ID}` lists those that are there"
        return f"the cable and the port's name{found}"
    return "the cable, the port's name and who else uses it"
