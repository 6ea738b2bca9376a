"""A copy of a database while others go on writing to it: one SQLite file, verified, on the disk, or nothing."""

from __future__ import annotations

import hashlib
import os
import sqlite3
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from labctl.errors import BadInput, StoreError
from labctl.store.connection.location import is_url, shown
from labctl.store.integrity.move import snapshot_to_file
from labctl.store.integrity.temporary_copy import temporary_copy

CHUNK = 1 << 20


@dataclass(frozen=True)
class Copy:
    """A backup that is on the disk under its own name."""

    path: Path
    bytes: int
    sha256: str


def copy_database(location: str, target: Path) -> Copy:
    """Copy a database into a new file, at one instant of its history: through SQLite's own backup, or from a server.

    Raises BadInput when the file exists, StoreError when the copy is not whole; then nothing is left of it. What a
    killed backup left in the same folder is removed.
    """
    if not is_url(location) and not Path(location).is_file():
        raise StoreError(f"{location}: there is no such file; name the database with --database")
    _refuse_existing(target)
    if not target.absolute().parent.is_dir():
        raise BadInput(f"{target}: the folder does not exist; create it first")
    try:
        with temporary_copy(target.absolute().parent) as copy_folder:
            if is_url(location):
                snapshot_to_file(location, copy_folder)
                _one_file(copy_folder)
            else:
                _copy(location, copy_folder)
            digest = _synced_digest(copy_folder)
            _refuse_existing(target)
            copy_folder.rename(target)
        _sync_folder(target.absolute().parent)
    except sqlite3.Error as error:
        raise StoreError(
            f"{target}: the copy of {shown(location)} is incomplete ({error}) and was removed; try again"
        ) from error
    return Copy(target, target.stat().st_size, digest)


def _refuse_existing(target: Path) -> None:
    if target.exists() or target.is_symlink():
        raise BadInput(f"{target}: the file exists already, and a backup never replaces a file; name a new file")


def _copy(location: str, made: Path) -> None:
    with closing(sqlite3.connect(location)) as source, closing(sqlite3.connect(made)) as copy:
        source.execute("PRAGMA query_only=ON")
        source.backup(copy)  # in one go, from one snapshot; the writer is not kept waiting
    _one_file(made)


def _one_file(made: Path) -> None:
    """Leave a copy as one file, with no log beside it. Raises sqlite3.DatabaseError where its pages do not fit."""
    with closing(sqlite3.connect(made)) as copy:
        copy.execute("PRAGMA journal_mode=DELETE")
        complaints = [row[0] for row in copy.execute("PRAGMA integrity_check(1)")]
        if complaints != ["ok"]:
            raise sqlite3.DatabaseError(complaints[0])


def _synced_digest(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        os.fsync(file.fileno())
        while chunk := file.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()


def _sync_folder(folder: Path) -> None:
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
