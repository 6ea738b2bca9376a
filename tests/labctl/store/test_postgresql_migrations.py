"""Migration on a PostgreSQL server from every earlier schema: the rows are those of the migrated file."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from alembic import command

from labctl.store import check, migrate, migrate_database
from labctl.store.connection.database import Database
from labctl.store.schema import tables
from tests.helpers.corpus import ENTRIES, Entry

#: Written by the migration itself, with its date and what follows from it; the leases of processes that have ended.
DATED = {"manifests", "manifest_head", "leases"}


def restored(entry: Entry, path: Path, url: str) -> None:
    """Bring what an earlier version left in a file to a server, at the schema of that version."""
    engine = sa.create_engine(url)
    with engine.begin() as connection, closing(sqlite3.connect(path)) as source:
        command.upgrade(migrate.configuration(connection), entry.name)
        metadata = sa.MetaData()
        metadata.reflect(connection)
        for table in reversed(metadata.sorted_tables):
            if table.name != migrate.STANDS_AT.name:
                connection.execute(sa.delete(table))
        for table in metadata.sorted_tables:
            if table.name != migrate.STANDS_AT.name:
                _bring(source, connection, table)
    engine.dispose()


def _bring(source: sqlite3.Connection, target: sa.Connection, table: sa.Table) -> None:
    names = ", ".join('"' + column.name + '"' for column in table.columns)
    rows = source.execute(f"SELECT {names} FROM {table.name}").fetchall()
    if not rows:
        return
    values = [{c.name: _value(c, each) for c, each in zip(table.columns, row, strict=True)} for row in rows]
    target.execute(sa.insert(table), values)
    for column in table.primary_key.columns:
        sequence = target.scalar(sa.select(sa.func.pg_get_serial_sequence(table.name, column.name)))
        if sequence is not None:
            target.execute(sa.select(sa.func.setval(sequence, max(row[column.name] for row in values))))


def _value(column: sa.Column[Any], stored: Any) -> Any:
    if stored is None:
        return sa.null() if isinstance(column.type, sa.JSON) else None
    if isinstance(column.type, sa.JSON):
        return json.loads(stored)
    return bool(stored) if isinstance(column.type, sa.Boolean) else stored


def rows_of(location: str) -> dict[str, list[Any]]:
    """Return the rows of every table that the migration does not date."""
    database = Database(location, write=False)
    with database.reading() as connection:
        found = {
            table.name: sorted((tuple(row) for row in connection.execute(sa.select(table))), key=repr)
            for table in tables.metadata.sorted_tables
            if table.name not in DATED
        }
    database.close()
    return found


@pytest.mark.slow
@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_every_earlier_schema_is_migrated_on_a_server_as_in_a_file(entry: Entry, url: str, tmp_path: Path) -> None:
    path = entry.unpack(tmp_path)
    restored(entry, path, url)
    for location in (str(path), url):
        done = migrate_database(location, copy=False)
        assert (done.before, done.after) == (entry.name, migrate.HEAD)
    in_file, on_server = rows_of(str(path)), rows_of(url)
    assert sum(map(len, in_file.values())) > 100
    for name in in_file:
        assert on_server[name] == in_file[name], name
    assert check(url).findings == ()


def test_an_empty_server_is_migrated_step_by_step(url: str) -> None:
    """Every revision alone, also those that left no database behind."""
    engine = sa.create_engine(url)
    for revision in sorted(migrate.KNOWN):
        with engine.begin() as connection:
            command.upgrade(migrate.configuration(connection), revision)
            assert migrate.revision_of(connection) == revision
    engine.dispose()
    Database(url, write=True).close()
    assert check(url).findings == ()
