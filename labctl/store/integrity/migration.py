"""Migration of a database of an earlier version, when a person asks: a verified copy first, then all or nothing."""

from __future__ import annotations

import fcntl
import hashlib
import os
import shutil
import sqlite3
import stat
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from labctl.errors import BadInput, StoreError
from labctl.store import migrate
from labctl.store.connection.database import Database
from labctl.store.connection.location import is_url, shown
from labctl.store.connection.private_files import FILE

# A folder in which a backup is made beside its target. One that a killed process left is removed by the next backup.
#
# SQLite writes a backup by its path and may put a log or a journal beside it, so that all of it is in one folder, which
# is removed whole. The folder is locked (`flock`) for as long as its process uses it: the kernel releases the lock with
# the process, however it ends. A process id would not tell that of another container.

PREFIX = ".labctl-backup-"
COPY = "copy.sqlite"
#: All that SQLite may make of one database.
_NAMES = frozenset({COPY, *(f"{COPY}{end}" for end in ("-wal", "-shm", "-journal"))})


@contextmanager
def temporary_copy(folder: Path) -> Iterator[Path]:
    """Give the path of an empty private file on the file system of a folder; it is removed if it is still there.

    What killed processes left in the folder is removed first. Raises OSError.
    """
    remove_abandoned(folder)
    made, handle = _locked_folder(folder)
    try:
        path = made / COPY
        file = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY, FILE)
        os.fchmod(file, FILE)  # whatever the umask takes away
        os.close(file)
        yield path
    finally:
        shutil.rmtree(made, ignore_errors=True)
        os.close(handle)


def remove_abandoned(folder: Path) -> list[Path]:
    """Remove this user's temporary folders in a folder that no process uses any more; returns them.

    One that holds anything else than a copy stays. Raises nothing.
    """
    removed = []
    with suppress(OSError):
        for found in sorted(folder.glob(f"{PREFIX}*")):
            with suppress(OSError):
                handle = os.open(found, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
                try:
                    if os.fstat(handle).st_uid == os.getuid() and _lock(handle) and _holds_only_a_copy(found):
                        shutil.rmtree(found)
                        removed.append(found)
                finally:
                    os.close(handle)
    return removed


def _locked_folder(folder: Path) -> tuple[Path, int]:
    while True:
        made = Path(tempfile.mkdtemp(dir=folder, prefix=PREFIX))
        try:
            made.chmod(stat.S_IRWXU)  # whatever the umask takes away
            handle = os.open(made, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:  # a backup that begins at this moment took it for one that was left
            continue
        try:
            free = _lock(handle)
        except OSError:  # a file system without locks: nothing is ever removed there as left
            return made, handle
        if free and made.exists():
            return made, handle
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


CHUNK = 1 << 20


@dataclass(frozen=True)
class Copy:
    """A backup that is on the disk under its own name."""

    path: Path
    bytes: int
    sha256: str


def copy_database(location: str, target: Path) -> Copy:
    """Copy a database into a new file, at one instant of its history, through SQLite's own backup.

    Raises BadInput when the file exists or the database is not SQLite's, StoreError when the copy is not whole; then
    nothing is left of it. What a killed backup left in the same folder is removed.
    """
    if is_url(location):
        raise BadInput(
            f"`labctl backup` copies SQLite files only, not a {location.partition('://')[0]} "
            "database; back it up with the tool of its server (pg_dump)"
        )
    if not Path(location).is_file():
        raise StoreError(f"{location}: there is no such file; name the database with --database")
    _refuse_existing(target)
    if not target.absolute().parent.is_dir():
        raise BadInput(f"{target}: the folder does not exist; create it first")
    try:
        with temporary_copy(target.absolute().parent) as made:
            _copy(location, made)
            digest = _synced_digest(made)
            _refuse_existing(target)
            made.rename(target)
        _sync_folder(target.absolute().parent)
    except sqlite3.Error as error:
        raise StoreError(
            f"{target}: the copy of {location} is incomplete ({error}) and was removed; try again"
        ) from error
    return Copy(target, target.stat().st_size, digest)


def _refuse_existing(target: Path) -> None:
    if target.exists() or target.is_symlink():
        raise BadInput(f"{target}: the file exists already, and a backup never replaces a file; name a new file")


def _copy(location: str, made: Path) -> None:
    with closing(sqlite3.connect(location)) as source, closing(sqlite3.connect(made)) as copy:
        source.execute("PRAGMA query_only=ON")
        source.backup(copy)  # in one go, from one snapshot; the writer is not kept waiting
        copy.execute("PRAGMA journal_mode=DELETE")  # one file, with no log beside it
        found = [row[0] for row in copy.execute("PRAGMA integrity_check(1)")]
        if found != ["ok"]:
            raise sqlite3.DatabaseError(found[0])


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


@dataclass(frozen=True)
class Migrated:
    """Between which schemas, and where the copy is; equal numbers: there was nothing to do."""

    before: str
    after: str
    copy: Copy | None


def needs_migration(location: str) -> bool:
    """Return whether a file is of an earlier version that is known here; raises StoreError for a damaged one."""
    path = Path(location)
    if not path.is_file() or not path.stat().st_size:
        return False
    with closing(Database(location, write=False, as_it_is=True)) as database:
        found = database.revision()
    return found in migrate.KNOWN and found != migrate.HEAD


def migrate_database(location: str, *, copy: bool) -> Migrated:
    """Bring a database to today's schema; no other process may hold it meanwhile.

    Raises BadInput where a copy is asked for that labctl cannot make, StoreError where there is no database, it is
    newer than this code or damaged, and Conflict where another process writes to it. Then it is as it was before.
    """
    named = shown(location)
    if not is_url(location) and not Path(location).is_file():
        raise StoreError(f"{location}: there is no such file; name the database with --database")
    with closing(Database(location, write=True, as_it_is=True)) as database:
        found = database.revision()
        migrate.refuse_unknown(found, named)
        if found is None:
            raise StoreError(f"{named}: this is not a labctl database: it has no tables; name another with --database")
        if found == migrate.HEAD:
            return Migrated(found, found, None)
        made = _copied(location, found) if copy else None
        database.upgrade()
    return Migrated(found, migrate.HEAD, made)


def _copied(location: str, found: str) -> Copy:
    if is_url(location):
        raise BadInput(
            f"{shown(location)}: labctl copies SQLite files only; back the database up with pg_dump, then run "
            "`labctl migrate --without-copy`"
        )
    return copy_database(location, _free_name(Path(location), found))


def _free_name(path: Path, found: str) -> Path:
    """Return a name beside the file that is not taken."""
    names = [f"{path.name}.schema-{found}", *(f"{path.name}.schema-{found}-{number}" for number in range(2, 100))]
    return next((free for free in map(path.with_name, names) if not free.exists()), path.with_name(names[-1]))
