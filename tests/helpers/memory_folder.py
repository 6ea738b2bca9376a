"""A folder in memory for what a run of the tests writes.

The databases of tests are written as those of the service are, and each of their transactions waits for the disk: with
a simulated campaign of two seconds of processor time that is four seconds of waiting, and more beside others.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

MEMORY = Path("/dev/shm")
PREFIX = f"tests-of-labctl-{os.getuid()}-"
#: What must be free: a run writes 0.5 GB, of which it removes most as it goes.
ROOM_BYTES = 4 * 2**30


def enter() -> Path | None:
    """Put the temporary files of this process, and of those that it starts, into memory; returns the folder.

    None where the temporary folder is given by TMPDIR, or the machine has no room in memory: nothing is changed then.
    What runs have left that were killed is removed.
    """
    if "TMPDIR" in os.environ or not os.access(MEMORY, os.W_OK) or shutil.disk_usage(MEMORY).free < ROOM_BYTES:
        return None
    for left in MEMORY.glob(f"{PREFIX}*"):
        if not _runs(int(left.name.removeprefix(PREFIX))):
            shutil.rmtree(left, ignore_errors=True)
    folder = MEMORY / f"{PREFIX}{os.getpid()}"
    folder.mkdir(mode=0o700)
    os.environ["TMPDIR"] = tempfile.tempdir = str(folder)
    return folder


def _runs(pid: int) -> bool:
    with suppress(PermissionError):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
    return True
