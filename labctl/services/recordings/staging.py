"""Folders for files on their way in or out. One that a killed process left is removed by the next service.

A folder is locked (`flock`) for as long as its process, or a child of it, uses it: the kernel releases the lock with
the process, also of one in another container that shares the folder for temporary files. A process id would not tell.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX = "labctl-staging-"


@contextmanager
def staging_folder() -> Iterator[Path]:
    """Yield an empty folder that only this user may enter; it is removed at the end. Raises OSError."""
    folder, handle = _locked_folder()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        os.close(handle)


def _locked_folder() -> tuple[Path, int]:
    while True:
        folder = Path(tempfile.mkdtemp(prefix=PREFIX))
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        if _lock(handle) and folder.exists():
            return folder, handle
        os.close(handle)  # a service that starts at this moment took it for one that was left


def _lock(handle: int) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def remove_abandoned() -> list[Path]:
    """Remove this user's folders that no process uses any more; returns them. Raises nothing."""
    removed = []
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with suppress(OSError):
            handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
            try:
                if os.fstat(handle).st_uid == os.getuid() and _lock(handle):
                    shutil.rmtree(folder)
                    removed.append(folder)
            finally:
                os.close(handle)
    return removed
