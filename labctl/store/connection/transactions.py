"""Transactions of repositories: run by the writing process itself, or sent to it by any other.

SQLite has one writing process. Every other one sends it a repository's method by name, with plain data as arguments:
the transaction begins and ends there, so that no other process can hold it open.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Concatenate, ParamSpec, Protocol, TypeVar, cast

from labctl.store.connection.database import Database

ArgumentsP = ParamSpec("ArgumentsP")
ResultT = TypeVar("ResultT")


class Repository(Protocol):
    """Anything that keeps its records in a database."""

    _database: Database


RepositoryT = TypeVar("RepositoryT", bound=Repository)

#: All methods that may be sent, by their names, as `Benches.mark`.
TRANSACTIONS: dict[str, Callable[..., object]] = {}


def transaction(
    method: Callable[Concatenate[RepositoryT, ArgumentsP], ResultT],
) -> Callable[Concatenate[RepositoryT, ArgumentsP], ResultT]:
    """Mark a repository's method as one short transaction.

    Arguments and result travel as JSON, by the types that the method declares (`labctl.processes.rpc_methods`).
    """
    name = method.__qualname__
    TRANSACTIONS[name] = method

    @functools.wraps(method)
    def run(self: RepositoryT, /, *args: ArgumentsP.args, **kwargs: ArgumentsP.kwargs) -> ResultT:
        writer = self._database.writer
        if writer is None:
            return self._database.outlast(lambda: method(self, *args, **kwargs))
        return cast(ResultT, writer.run(name, args, kwargs))

    return run


def outlasting(
    method: Callable[Concatenate[RepositoryT, ArgumentsP], ResultT],
) -> Callable[Concatenate[RepositoryT, ArgumentsP], ResultT]:
    """Mark a method that writes in this process: it is repeated where the server did not answer and nothing was stored.

    So it may not change its own object before its transaction is committed.
    """

    @functools.wraps(method)
    def run(self: RepositoryT, /, *args: ArgumentsP.args, **kwargs: ArgumentsP.kwargs) -> ResultT:
        return self._database.outlast(lambda: method(self, *args, **kwargs))

    return run


def run_transaction(
    repositories: Mapping[str, object], name: str, args: tuple[object, ...], kwargs: Mapping[str, object]
) -> object:
    """Run a transaction that another process sent; `repositories` by the names of their classes.

    Raises KeyError for a name that is not of a transaction.
    """
    if name not in TRANSACTIONS:
        raise KeyError(name)
    repository, _, method = name.partition(".")
    return getattr(repositories[repository], method)(*args, **kwargs)
