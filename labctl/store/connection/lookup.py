"""Reads of one statement by keys, for requests in an event loop: from a server without a thread, from a file in one.

A server is asked once there and back: a statement by itself sees one state of the database, so there is no transaction
around it, and it is planned once for each connection, whatever the keys are (PostgreSQL 15 documentation, 20.7.4):
planning takes ten times as long as reading the rows. It goes through psycopg's wrapper of libpq (psycopg 3
documentation, "pq - libpq wrapper module"), which takes half the processor time of its cursors.
"""

from __future__ import annotations

import asyncio
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Protocol

import sqlalchemy as sa

from labctl.errors import DatabaseUnreachable, StoreError

if TYPE_CHECKING:
    import psycopg
    from psycopg.pq.abc import PGconn, PGresult

#: The parameter of every statement: the keys.
KEYS = "keys"
#: A server that does not answer is asked again after so long, s.
RETRY_S = 0.2
#: A socket that takes no more is tried again after so long, s.
FLUSH_S = 0.001
_PREPARED, _BINARY = b"lookup", 1


def one_of_keys(column: sa.ColumnElement[str], *, is_shared: bool) -> sa.ColumnElement[bool]:
    """Return the condition that a column is one of the keys; for a server (`is_shared`) they are one array."""
    if is_shared:
        from sqlalchemy.dialects.postgresql import ARRAY  # noqa: PLC0415  most databases are files

        return column == sa.any_(sa.bindparam(KEYS, type_=ARRAY(sa.Text)))
    return column.in_(sa.bindparam(KEYS, expanding=True))


class Lookup(Protocol):
    """Reads of one statement, one at a time."""

    async def rows(self, keys: Sequence[str]) -> Sequence[Any]:
        """Return the rows of the statement for these keys, with its columns as attributes. Raises StoreError."""
        ...

    def close(self) -> None:
        """End a thread, or a connection; a read that is under way is not waited for."""
        ...


class FileLookup:
    """Reads from a file, in a thread of their own."""

    def __init__(
        self, reading: Callable[[], AbstractContextManager[sa.Connection]], statement: sa.Select[*tuple[Any, ...]]
    ) -> None:
        self._reading, self._statement = reading, statement
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="lookup")

    async def rows(self, keys: Sequence[str]) -> Sequence[Any]:
        """Return the rows for these keys. Raises StoreError."""
        return await asyncio.get_running_loop().run_in_executor(self._thread, self._read, list(keys))

    def _read(self, keys: list[str]) -> Sequence[Any]:
        with self._reading() as connection:
            return connection.execute(self._statement, {KEYS: keys}).all()

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown(wait=False, cancel_futures=True)


class ServerLookup:
    """Reads from a server, over a connection of their own that opens with the first, and again after it was lost."""

    def __init__(
        self,
        connection: Mapping[str, Any],
        statement: sa.Select[*tuple[Any, ...]],
        unread: Callable[[psycopg.Error], StoreError],
        patience_s: float,
    ) -> None:
        """`connection` are psycopg's arguments. `unread` gives what is raised in place of an error of psycopg.

        A server that is away (DatabaseUnreachable) is asked again for `patience_s`, once it has answered before.
        """
        from sqlalchemy.dialects.postgresql.base import PGDialect  # noqa: PLC0415  most databases are files

        dialect = PGDialect(paramstyle="numeric_dollar")  # type: ignore[no-untyped-call]
        compiled = statement.compile(dialect=dialect)
        self._sql = str(compiled).encode()
        self._given = [None if name == KEYS else compiled.params[name] for name in compiled.positiontup or ()]
        columns = list(statement.selected_columns)
        self._row: Callable[..., Any] = namedtuple("Row", [column.key for column in columns])  # type: ignore[misc]
        self._processors = [column.type.result_processor(dialect, None) for column in columns]
        self._connection, self._unread, self._patience_s = connection, unread, patience_s
        self._is_away = False
        self._opened: tuple[asyncio.AbstractEventLoop, psycopg.AsyncConnection[Any]] | None = None
        self._loads: list[Callable[[Any], Any]] = []

    async def rows(self, keys: Sequence[str]) -> Sequence[Any]:
        """Return the rows for these keys. Raises StoreError; DatabaseUnreachable after `patience_s`."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + (0.0 if self._is_away else self._patience_s)
        while True:
            was_open = self._opened is not None
            try:
                rows = await self._asked(keys)
            except StoreError as error:
                self.close()
                if not isinstance(error, DatabaseUnreachable) or loop.time() >= end_s:
                    self._is_away = isinstance(error, DatabaseUnreachable)
                    raise
                if not was_open:  # else it was lost since the server was last asked, and may open at once
                    await asyncio.wait({loop.create_future()}, timeout=RETRY_S)
            except BaseException:  # the answer that is under way would be taken for that of the next read
                self.close()
                raise
            else:
                self._is_away = False
                return rows

    async def _asked(self, keys: Sequence[str]) -> Sequence[Any]:
        import psycopg  # noqa: PLC0415  it is an extra

        try:
            connection = await self._connected()
            texts = [_array(keys) if fixed is None else str(fixed).encode() for fixed in self._given]
            connection.pgconn.send_query_prepared(_PREPARED, texts, result_format=_BINARY)
            return self._decoded(connection, await _result(connection.pgconn))
        except psycopg.Error as error:
            raise self._unread(error) from error

    async def _connected(self) -> psycopg.AsyncConnection[Any]:
        """Return the connection; it belongs to an event loop, and the statement is prepared on it."""
        import psycopg  # noqa: PLC0415

        loop = asyncio.get_running_loop()
        if self._opened is not None and self._opened[0] is loop:
            return self._opened[1]
        self.close()
        connection = await psycopg.AsyncConnection.connect(**self._connection, autocommit=True)
        self._opened, self._loads = (loop, connection), []
        connection.pgconn.send_prepare(_PREPARED, self._sql)
        await _result(connection.pgconn)
        return connection

    def _decoded(self, connection: psycopg.AsyncConnection[Any], result: PGresult) -> list[Any]:
        from psycopg.pq import Format  # noqa: PLC0415

        if not self._loads:
            for column, process in enumerate(self._processors):
                kind = connection.adapters.get_loader(result.ftype(column), Format.BINARY)
                assert kind is not None, f"psycopg has no loader for column {column}"
                self._loads.append(_processed(kind(result.ftype(column), connection).load, process))
        value_of, loads = result.get_value, tuple(enumerate(self._loads))
        rows = []
        for n in range(result.ntuples):
            values = [value_of(n, column) for column, _ in loads]
            rows.append(self._row(*[None if values[k] is None else load(values[k]) for k, load in loads]))
        return rows

    def close(self) -> None:
        """End the connection."""
        if self._opened is not None:
            self._opened[1].pgconn.finish()
            self._opened = None


def _processed(load: Callable[[Any], Any], process: Callable[[Any], Any] | None) -> Callable[[Any], Any]:
    """Return what makes the value of a column from the bytes of the server: by psycopg, then by its type."""
    return load if process is None else lambda value: process(load(value))


def _array(texts: Sequence[str]) -> bytes:
    """Return texts as an array of PostgreSQL (PostgreSQL 15 documentation, 8.15.6).

    A character that the server cannot hold becomes `?`: one such key must not fail the statement of the others.
    """
    quoted = (text.replace("\\", "\\\\").replace('"', '\\"').replace("\0", "?") for text in texts)
    return ("{" + ",".join(f'"{text}"' for text in quoted) + "}").encode("utf-8", "replace")


async def _result(connection: PGconn) -> PGresult:
    """Return the result of what was sent. Raises psycopg.Error for one that is an error, or for a lost connection."""
    from psycopg import errors, pq  # noqa: PLC0415

    loop = asyncio.get_running_loop()
    while connection.flush():  # seldom: what is sent fits into the buffer of a socket
        await asyncio.wait({loop.create_future()}, timeout=FLUSH_S)
    done: asyncio.Future[PGresult] = loop.create_future()
    results: list[PGresult] = []

    def arrived() -> None:
        try:
            connection.consume_input()
            while not done.done() and not connection.is_busy():
                if (result := connection.get_result()) is None:
                    done.set_result(results[0])
                else:
                    results.append(result)
        except Exception as error:  # noqa: BLE001  it is raised where the result is waited for
            if not done.done():
                done.set_exception(error)

    socket = connection.socket
    loop.add_reader(socket, arrived)
    try:
        result = await done
    finally:
        loop.remove_reader(socket)
    if result.status not in (pq.ExecStatus.COMMAND_OK, pq.ExecStatus.TUPLES_OK):
        raise errors.error_from_result(result)
    return result
