"""A database moved from SQLite to PostgreSQL or back: row by row as they are stored, compared block by block.

The rows are those of every table, with the numbers they have: chains of hashes, manifests and the audit trail stay
valid. Blocks of rows are copied in the order of their keys, each in a transaction of its own, and read back. A move
that was interrupted is done again: blocks that are there already are compared with the source and kept. Until it has
ended, the target stands at a revision that no version of labctl opens.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from sqlalchemy import exc

from labctl.errors import BadInput, Conflict, OldSchema, StoreError
from labctl.store import migrate
from labctl.store.connection.database import Database
from labctl.store.connection.location import is_url, shown
from labctl.store.integrity.check import Progress
from labctl.store.schema import tables

#: Rows of a block: of readings, which are some hundred kB each, and of anything else.
READINGS_ROWS, ROWS = 32, 2000


@dataclass(frozen=True)
class Moved:
    """What a move has brought to its target."""

    tables: int
    rows: int
    kept: int  #: rows that an earlier move had brought, compared again
    sha256: str  #: of all rows, as both databases store them


def move_database(source: str, target: str, progress: Progress = lambda *_: None) -> Moved:
    """Bring every row of a database into another, empty one, by path or URL; the source stays as it is.

    Raises Conflict while a process holds the source or drives a bench of it, BadInput for a target that is not empty,
    OldSchema for a source of an earlier version, StoreError where a row is not the same afterwards.
    """
    _refuse_pair(source, target)
    with ExitStack() as stack:
        old = stack.enter_context(closing(Database(source, write=not is_url(source), as_it_is=True)))
        _refuse_other_schema(old, source)
        new = stack.enter_context(closing(Database(target, write=True, as_it_is=True)))
        reading = stack.enter_context(_snapshot(old))
        _refuse_driven(reading, source)
        _begin(new, target)
        moved = _Move(reading, new, progress)
        for table in tables.metadata.sorted_tables:
            moved.bring(table)
        _end(new)
        return Moved(len(tables.metadata.sorted_tables), moved.rows, moved.kept, moved.digest.hexdigest())


def snapshot_to_file(source: str, file: Path) -> None:
    """Write a database on a server, as it is at one instant, into an empty SQLite file; others go on writing to it.

    Leases stay behind: no process drives a bench from the copy. Raises OldSchema, BadInput, StoreError.
    """
    with ExitStack() as stack:
        old = stack.enter_context(closing(Database(source, write=False, as_it_is=True)))
        _refuse_other_schema(old, source)
        new = stack.enter_context(closing(Database(str(file), write=True, as_it_is=True)))
        reading = stack.enter_context(_snapshot(old))
        _begin(new, str(file))
        copied = _Move(reading, new, lambda *_: None)
        for table in tables.metadata.sorted_tables:
            if table is not tables.leases:
                copied.bring(table)
        _end(new)


def _refuse_pair(source: str, target: str) -> None:
    if not is_url(source) and not Path(source).is_file():
        raise BadInput(f"{source}: there is no such file; name the database to move from")
    if source == target or (not is_url(target) and Path(source).resolve() == Path(target).resolve()):
        raise BadInput(f"{shown(target)}: a database cannot be moved to itself; name another target")
    if not is_url(target) and not Path(target).absolute().parent.is_dir():
        raise BadInput(f"{target}: the folder does not exist; create it first")


def _refuse_other_schema(database: Database, location: str) -> None:
    revision = database.revision()
    migrate.refuse_unknown(revision, shown(location))
    if revision is None:
        raise BadInput(f"{shown(location)}: the database is empty; name the database to move from")
    if revision != migrate.HEAD:
        raise OldSchema(
            f"{shown(location)}: the schema of the database is number {revision}, this version of labctl needs number "
            f"{migrate.HEAD}; run `labctl migrate --database {shown(location)}` first"
        )


@contextmanager
def _snapshot(database: Database) -> Iterator[sa.Connection]:
    """Yield a connection that sees the database as it is now, whatever is written to it meanwhile."""
    with database.reading() as connection:
        if connection.dialect.name != "sqlite":
            connection.execution_options(isolation_level="REPEATABLE READ")
        with connection.begin():
            migrate.revision_of(connection)  # a server takes its snapshot with the first query
            yield connection


def _refuse_driven(reading: sa.Connection, location: str) -> None:
    """Raise Conflict where a process drives a bench: its campaign would go on in the database that is left behind."""
    lease = reading.execute(sa.select(tables.leases.c.bench_name, tables.leases.c.host, tables.leases.c.pid)).first()
    if lease is not None:
        raise Conflict(
            f"{shown(location)}: process {lease.pid} on {lease.host} holds bench {lease.bench_name}; end its "
            "service or campaign first, so that nothing is written to the database that is left behind"
        )


def _begin(database: Database, location: str) -> None:
    """Make the tables of an empty target, and mark it as unfinished; go on with one that is marked."""
    revision = database.revision()
    if revision == migrate.MOVING:
        return
    if revision is not None:
        raise BadInput(
            f"{shown(location)}: the database has the tables of labctl already; name an empty database or a new file"
        )
    database.upgrade()
    with database.writing() as connection:
        for table in reversed(tables.metadata.sorted_tables):  # the first rows, of which the source has its own
            connection.execute(sa.delete(table))
        connection.execute(sa.update(migrate.STANDS_AT).values(version_num=migrate.MOVING))


def _end(database: Database) -> None:
    """Let the target count its rows from the highest on, and open it for use: all in one transaction."""
    with database.writing() as connection:
        if connection.dialect.name == "sqlite":
            if broken := connection.exec_driver_sql("PRAGMA foreign_key_check").first():
                raise StoreError(f"a row of {broken[0]} refers to a row of {broken[2]} that is absent; move again")
        else:
            for table in tables.metadata.sorted_tables:
                _count_on(connection, table)
        connection.execute(sa.update(migrate.STANDS_AT).values(version_num=migrate.HEAD))


def _count_on(connection: sa.Connection, table: sa.Table) -> None:
    column = table.autoincrement_column
    if column is None:
        return
    sequence = connection.scalar(sa.select(sa.func.pg_get_serial_sequence(table.name, column.name)))
    highest = connection.scalar(sa.select(sa.func.max(column)))
    if sequence is not None and highest is not None:
        connection.execute(sa.select(sa.func.setval(sequence, highest)))


class _Move:
    """Copies tables in one direction."""

    def __init__(self, source: sa.Connection, target: Database, progress: Progress) -> None:
        self._source, self._target, self._progress = source, target, progress
        self.rows = self.kept = 0
        self.digest = hashlib.sha256()

    def bring(self, table: sa.Table) -> None:
        """Bring one table, and compare each block of it with what was brought. Raises StoreError."""
        total = self._source.scalar(sa.select(sa.func.count()).select_from(table)) or 0
        keys, size = list(table.primary_key.columns), READINGS_ROWS if table is tables.sample_blocks else ROWS
        done, after = 0, None
        while True:
            block = _rows(self._source, table, keys, after, size)
            last = _key(block[-1], keys) if len(block) == size else None  # None: up to the end of the table
            self._bring_block(table, keys, block, after, last)
            done += len(block)
            self._progress(table.name, done, total)
            if last is None:
                return
            after = last

    def _bring_block(
        self, table: sa.Table, keys: list[sa.Column[Any]], block: list[Mapping[str, Any]], after: Key, last: Key
    ) -> None:
        """Write the rows of a block that are not there yet; those in the target between two keys must then be it."""
        with self._target.reading() as connection:
            there = _rows(connection, table, keys, after, None, last)
        if there != block:
            present = {_key(row, keys) for row in there}
            missing = [row for row in block if _key(row, keys) not in present]
            self._write(table, missing)
            with self._target.reading() as connection:
                now = _rows(connection, table, keys, after, None, last)
            if now != block:
                raise StoreError(
                    f"table {table.name}: the rows after {after} are not those of the source; if the source was used "
                    "since an earlier move was interrupted, empty the target and move again"
                )
        self.kept += len(there)
        self.rows += len(block)
        for row in block:
            self.digest.update(repr((table.name, *row.values())).encode())

    def _write(self, table: sa.Table, rows: Sequence[Mapping[str, Any]]) -> None:
        if not rows:
            return
        with self._target.writing() as connection:
            is_server = connection.dialect.name != "sqlite"
            values = {column.name: _bound(column, is_server=is_server) for column in table.columns}
            raw = sa.table(table.name, *(sa.column(name) for name in values))
            try:
                connection.execute(sa.insert(raw).values(values), [dict(row) for row in rows])
            except exc.DataError as error:
                raise StoreError(
                    f"table {table.name}: the target does not take a value ({error.orig}); correct it in the source"
                ) from error


#: Values of the primary key of a row; None: before the first, or after the last.
Key = tuple[object, ...] | None


def _key(row: Mapping[str, Any], keys: Sequence[sa.Column[Any]]) -> tuple[object, ...]:
    return tuple(row[column.name] for column in keys)


def _is_json(column: sa.Column[Any]) -> bool:
    return isinstance(column.type, sa.JSON)


def _stored_type(column: sa.Column[Any]) -> sa.types.TypeEngine[Any]:
    """Return the type in which a value is stored, without what labctl makes of it."""
    if _is_json(column):
        return sa.Text()
    return column.type.impl_instance if isinstance(column.type, sa.TypeDecorator) else column.type


def _bound(column: sa.Column[Any], *, is_server: bool) -> sa.ColumnElement[Any]:
    """Return the parameter of a column; a document is text, which a server casts."""
    parameter = sa.bindparam(column.name, type_=_stored_type(column))
    return sa.cast(parameter, sa.JSON) if _is_json(column) and is_server else parameter


def _rows(
    connection: sa.Connection, table: sa.Table, keys: Sequence[sa.Column[Any]], after: Key, limit: int | None,
    last: Key = None,
) -> list[Mapping[str, Any]]:  # fmt: skip
    """Return rows as they are stored, by key: those after a key, at most so many, or up to another key."""
    stored = [_ordered(column, connection) for column in keys]
    shown_columns = [_stored(column).label(column.name) for column in table.columns]
    query = sa.select(*shown_columns).order_by(*stored).limit(limit)
    if after is not None:
        query = query.where(sa.tuple_(*stored) > sa.tuple_(*_literals(keys, after)))
    if last is not None:
        query = query.where(sa.tuple_(*stored) <= sa.tuple_(*_literals(keys, last)))
    return [{name: _comparable(value) for name, value in row.items()} for row in connection.execute(query).mappings()]


def _stored(column: sa.Column[Any]) -> sa.ColumnElement[Any]:
    return sa.cast(column, sa.Text) if _is_json(column) else sa.type_coerce(column, _stored_type(column))


def _ordered(column: sa.Column[Any], connection: sa.Connection) -> sa.ColumnElement[Any]:
    """Return a key in the order that both kinds of database have: texts by their bytes, in any language."""
    stored = _stored(column)
    is_text = isinstance(stored.type, sa.String)
    return sa.collate(stored, "C") if is_text and connection.dialect.name != "sqlite" else stored


def _comparable(value: Any) -> Any:
    """Return a value as SQLite stores it, which knows no number that is none."""
    return None if isinstance(value, float) and math.isnan(value) else value


def _literals(keys: Sequence[sa.Column[Any]], values: tuple[object, ...]) -> list[sa.ColumnElement[Any]]:
    return [sa.literal(value, _stored_type(column)) for column, value in zip(keys, values, strict=True)]
