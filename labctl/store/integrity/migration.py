"""Migration of a database of an earlier version, when a person asks: a verified copy first, then all or nothing."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from labctl.errors import BadInput, StoreError
from labctl.store import migrate
from labctl.store.connection.database import Database
from labctl.store.connection.location import is_url, shown
from labctl.store.integrity.backup import Copy, copy_database


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
        revision = database.revision()
    return revision in migrate.KNOWN and revision != migrate.HEAD


def migrate_database(location: str, *, copy: bool) -> Migrated:
    """Migrate a database to the present schema; no other process may hold it meanwhile.

    Raises BadInput where a copy is asked for that labctl cannot make, StoreError where there is no database, it is
    newer than this code or damaged, and Conflict where another process writes to it. Then it is as it was before.
    """
    named = shown(location)
    if not is_url(location) and not Path(location).is_file():
        raise StoreError(f"{location}: there is no such file; name the database with --database")
    with closing(Database(location, write=True, as_it_is=True)) as database:
        revision = database.revision()
        migrate.refuse_unknown(revision, named)
        if revision is None:
            raise StoreError(f"{named}: this is not a labctl database: it has no tables; name another with --database")
        if revision == migrate.HEAD:
            if is_url(location):
                database.upgrade()  # an index that the server could not have when the tables were made
            return Migrated(revision, revision, None)
        backup_path = _copied(location, revision) if copy else None
        database.upgrade()
    return Migrated(revision, migrate.HEAD, backup_path)


def _copied(location: str, revision: str) -> Copy:
    if is_url(location):
        raise BadInput(
            f"{shown(location)}: labctl copies SQLite files only; back the database up with pg_dump, then run "
            "`labctl migrate --without-copy`"
        )
    return copy_database(location, _free_name(Path(location), revision))


def _free_name(path: Path, revision: str) -> Path:
    """Return a name beside the file that is not taken."""
    names = [f"{path.name}.schema-{revision}", *(f"{path.name}.schema-{revision}-{number}" for number in range(2, 100))]
    return next((free for free in map(path.with_name, names) if not free.exists()), path.with_name(names[-1]))
