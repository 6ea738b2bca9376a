"""Which file a database is: one that was deleted or replaced below a running process is not written to any more.

SQLite goes on writing into a file that has no name any more, and reports success. So the writer remembers device and
inode of the database and, as soon as it is there, of its write-ahead log, and compares them before every commit: two
system calls, some microseconds.
"""

from __future__ import annotations

import os
from pathlib import Path

Identity = tuple[int, int]


def identity_of(path: str) -> Identity | None:
    """Return device and inode of what a path names; None where there is nothing."""
    try:
        found = os.stat(path)  # noqa: PTH116  before every commit: a Path costs several times as much
    except OSError:
        return None
    return found.st_dev, found.st_ino


class FileIdentity:
    """The files of one open SQLite database."""

    def __init__(self, location: str) -> None:
        """Remember the database; it has to be there."""
        self._paths = (str(location), f"{location}-wal")
        self._known = [identity_of(path) for path in self._paths]

    def forget_log(self) -> None:
        """Note that the writing connection is opened anew, and perhaps the log with it."""
        self._known[1] = None

    def changed(self) -> str:
        """Say what has become of the files since they were opened; empty while they are the same.

        The log is remembered when it is there for the first time. It stays for as long as a connection is open.
        """
        for index, path in enumerate(self._paths):
            known, now = self._known[index], identity_of(path)
            if known is None:
                self._known[index] = now
            elif known != now:
                was = "deleted" if now is None else "replaced by another file"
                return (
                    f"{self._paths[0]}: {Path(path).name} was {was} while this process had it open; labctl writes "
                    "nothing more. Stop this process, put the file or the newest backup there, check it with "
                    "`labctl check`, and start again"
                )
        return ""
