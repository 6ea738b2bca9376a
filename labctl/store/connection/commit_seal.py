"""A small file beside an SQLite database that counts its commits, so that a log that was deleted is missed.

Commits live in the write-ahead log until a checkpoint brings them into the database. Deleting the log, or putting an
older copy of the database in its place, leaves a database that is whole and too old. Every synced commit counts itself
in the database (`user_version`, which nothing else uses) and then here. The seal is never ahead of the disk.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import sqlalchemy as sa

from labctl.store.connection.private_files import make_private

WIDTH = 12


def seal_path(location: str) -> Path:
    """Return the path of a database's seal."""
    return Path(f"{location}.seal")


def sealed(location: str) -> int:
    """Return how many commits the seal counts; 0 without one."""
    try:
        return int(seal_path(location).read_text(encoding="ascii"))
    except (OSError, ValueError):
        return 0


def seal(location: str, commits: int) -> None:
    """Write the number down, over the one before: the same few bytes, so that a full disk does not matter.

    A seal that cannot be written fails no commit: it only guards less.
    """
    with contextlib.suppress(OSError):
        make_private(seal_path(location))
        handle = os.open(seal_path(location), os.O_WRONLY)
        try:
            os.pwrite(handle, f"{commits:0{WIDTH}d}\n".encode(), 0)
        finally:
            os.close(handle)


def commits_of(connection: sa.Connection) -> int:
    """Return how many synced commits an SQLite database holds."""
    return int(connection.exec_driver_sql("PRAGMA user_version").scalar_one())


def count_commit(connection: sa.Connection) -> int:
    """Count the transaction that is open as one more; returns the number."""
    commits = commits_of(connection) + 1
    connection.exec_driver_sql(f"PRAGMA user_version={commits}")
    return commits


def missing(connection: sa.Connection | None, location: str) -> str | None:
    """Return what is missing when a database is older than its seal; None when all is there."""
    counted = sealed(location)
    n_commits = commits_of(connection) if connection is not None else 0
    if n_commits >= counted:
        return None
    return (
        f"{counted - n_commits} commits that were made are not in this database: its write-ahead log "
        f"({Path(location).name}-wal) was deleted, a write was interrupted, or an older copy was put in its place; "
        f"restore the newest backup, or, to continue without these commits, remove {seal_path(location)}"
    )
