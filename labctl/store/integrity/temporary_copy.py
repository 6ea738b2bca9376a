"""A folder in which a backup is made beside its target. One that a killed process left is removed by the next backup.

SQLite writes a backup by its path and may put a log or a journal beside it, so that all of it is in one folder, which
is removed whole. The folder is locked (`flock`) for as long as its process uses it: the kernel releases the lock with
the process, however it ends. A process id would not tell that of another container.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from labctl.store.connection.private_files import FILE

PREFIX = ".labctl-backup-"
COPY = "copy.sqlite"
#: All that SQLite may make of one database.
_NAMES = frozenset({COPY, *(f"{COPY}{end}" for end in ("-wal", "-shm", "-journal", ".lock", ".seal", ".anchor"))})


@contextmanager
def temporary_copy(folder: Path) -> Iterator[Path]:
    """Yield the path of an empty private file on the file system of a folder; it is removed if it is still there.

    What killed processes left in the folder is removed first. Raises OSError.
    """
    remove_abandoned(folder)
    folder_made, handle = _locked_folder(folder)
    try:
        path = folder_made / COPY
        file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, FILE)
        os.fchmod(file, FILE)  # whatever the umask takes away
        os.close(file)
        yield path
    finally:
        shutil.rmtree(folder_made, ignore_errors=True)
        os.close(handle)


def remove_abandoned(folder: Path) -> list[Path]:
    """Remove this user's temporary folders in a folder that no process uses any more; returns them.

    One that holds anything else than a copy stays. Raises nothing.
    """
    removed = []
    with suppress(OSError):
        for path in sorted(folder.glob(f"{PREFIX}*")):
            with suppress(OSError):
                handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
                try:
                    if os.fstat(handle).st_uid == os.getuid() and _lock(handle) and _holds_only_a_copy(path):
                        shutil.rmtree(path)
                        removed.append(path)
                finally:
                    os.close(handle)
    return removed


def _locked_folder(folder: Path) -> tuple[Path, int]:
    while True:
        private_folder = Path(tempfile.mkdtemp(dir=folder, prefix=PREFIX))
        try:
            private_folder.chmod(stat.S_IRWXU)  # whatever the umask takes away
            handle = os.open(private_folder, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:  # a backup that begins at this moment took it for one that was left
            continue
        try:
            free = _lock(handle)
        except OSError:  # a file system without locks: nothing is ever removed there as left
            return private_folder, handle
        if free and private_folder.exists():
            return private_folder, handle
        os.close(handle)


def _lock(handle: int) -> bool:
    """Return whether no other process uses a folder; raises OSError where the file system has no locks."""
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _holds_only_a_copy(folder: Path) -> bool:
    return all(each.name in _NAMES and stat.S_ISREG(each.lstat().st_mode) for each in folder.iterdir())
