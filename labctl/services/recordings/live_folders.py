"""The folders of live calibrations: where they are, who uses them, and what one that was killed has left.

A folder is locked (`flock`) from its first reading until its readings are in the database: the kernel releases the lock
with the process. One that no process uses was left by a session that was killed, or that the database refused.
"""

from __future__ import annotations

import fcntl
import os
import re
import shlex
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from labctl.config import default_database
from labctl.errors import LabctlError
from labctl.recording import RecordingInfo
from labctl.recording.files import HEAD, read_head
from labctl.store import Store, is_url, open_store

#: What the names of such folders begin with, and the file of their readings.
PREFIX, SAMPLES = "live-", "samples.csv"
#: So much of a file of readings is counted at a time, bytes.
CHUNK = 1 << 20


def usual_folder(database: str | None, serial: str, stamp: str) -> Path:
    """Return the folder of a unit's readings from the time `stamp` on.

    What of a serial number cannot be in the name of a file is a line there.
    """
    serial = re.sub(r"[^\w.-]", "_", serial)
    return usual_place(database or default_database()) / f"{PREFIX}{serial}-{stamp}"


def usual_place(location: str) -> Path:
    """Return where such folders are: beside the file, or in the user's data folder for the database of a server."""
    if is_url(location):
        from platformdirs import user_data_path  # noqa: PLC0415  the command line starts in a tenth of a second

        return Path(user_data_path("labctl"))
    return Path(location).absolute().parent


def lock(folder: Path) -> int:
    """Mark a folder as in use; returns what `unlock` takes. Raises OSError."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    with suppress(OSError):  # a file system without locks
        fcntl.flock(handle, fcntl.LOCK_EX)
    return handle


def unlock(handle: int) -> None:
    """End the use of a folder, also where a child of this process has the same lock."""
    with suppress(OSError):
        fcntl.flock(handle, fcntl.LOCK_UN)
    os.close(handle)


def _is_in_use(folder: Path) -> bool:
    """Return whether a process writes or imports the readings of a folder now."""
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:  # a file system without locks
        return False
    finally:
        os.close(handle)
    return False


@dataclass(frozen=True)
class KeptReadings:
    """A folder of a live calibration whose readings are in no recording."""

    folder: Path
    serial: str  #: of the unit; empty where the head of the folder cannot be read
    readings: int  #: whole lines

    @property
    def text(self) -> str:
        """What it is, and the command that imports it, in one line."""
        of_unit = f" of {self.serial}" if self.serial else ""
        return (
            f"{self.readings} readings{of_unit} that a live calibration left are in no recording; import them with "
            f"`labctl import {shlex.quote(str(self.folder))}`, then remove the folder"
        )


def kept_readings(location: str, store: Store | None) -> list[KeptReadings]:
    """Return such folders beside the database at `location`, sorted by path.

    One that a running session uses is none, nor one without a whole reading, nor one whose readings are a recording of
    `store`. Raises StoreError.
    """
    kept_sessions = []
    for head in sorted(usual_place(location).glob(f"{PREFIX}*/{HEAD}")):
        folder = head.parent
        if _is_in_use(folder):
            continue
        readings, info = _count(folder / SAMPLES), _info(head)
        if readings and not (info is not None and store is not None and _is_stored(store, info, readings)):
            kept_sessions.append(KeptReadings(folder, "" if info is None else info.serial, readings))
    return kept_sessions


def kept_beside(database: str | None) -> list[KeptReadings]:
    """Return those of `kept_readings` for a command, which may have no database yet, or none that can be read."""
    location = database or default_database()
    if not is_url(location) and not Path(location).is_file():
        return kept_readings(location, None)
    if not kept_readings(location, None):  # a database is opened only where there is something to look up in it
        return []
    with suppress(LabctlError), open_store(location, write=False) as store:
        return kept_readings(location, store)
    return kept_readings(location, None)


def folders_of(kept: Sequence[KeptReadings]) -> list[str]:
    """Return the paths of the folders."""
    return [str(each.folder) for each in kept]


def _info(head: Path) -> RecordingInfo | None:
    try:
        return read_head(head)
    except (LabctlError, OSError):
        return None


def _count(samples: Path) -> int:
    """Return the whole lines below the header; a line that a failure of power cut off is not counted."""
    lines = 0
    try:
        with samples.open("rb") as file:
            while chunk := file.read(CHUNK):
                lines += chunk.count(b"\n")
    except OSError:
        return 0
    return max(lines - 1, 0)


def _is_stored(store: Store, info: RecordingInfo, readings: int) -> bool:
    """Return whether a recording of the unit began at the same time and has as many readings."""
    return any(
        row.readings == readings and row.recording_info.started_at == info.started_at
        for row in store.recordings.of_unit(info.serial)
    )
