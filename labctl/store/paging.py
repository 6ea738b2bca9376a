"""Long lists in parts: which rows of a list are asked for, and one part of it with what the next part begins after.

A part begins after the key of the last row of the one before, not at an offset: rows that are added meanwhile neither
hide a row nor show one twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import sqlalchemy as sa

RowT = TypeVar("RowT")
KeyT = TypeVar("KeyT", str, int)
#: SQLite takes 32,766 parameters in a statement, PostgreSQL 65,535.
MAX_PARAMETERS = 10_000


@dataclass(frozen=True)
class PageRequest(Generic[KeyT]):
    """Which rows: those whose texts hold `search` (any case), at most `limit`, behind the row with the key `after`."""

    search: str = ""
    limit: int | None = None
    after: KeyT | None = None

    def matching(self, texts: Sequence[sa.ColumnElement[str]]) -> sa.ColumnElement[bool]:
        """Return the condition that one of the texts holds what is searched for; % and _ stand for themselves."""
        if not self.search:
            return sa.true()
        return sa.or_(*(text.icontains(self.search, autoescape=True) for text in texts))


@dataclass(frozen=True)
class Page(Generic[RowT, KeyT]):
    """Some rows of a list of `total` that match; `next_after` is the key to ask for the next with, None at the end."""

    rows: list[RowT]
    total: int
    next_after: KeyT | None = None

    @staticmethod
    def of(
        rows: Sequence[RowT], key: Callable[[RowT], KeyT], request: PageRequest[KeyT], total: int
    ) -> Page[RowT, KeyT]:
        """Return a page of rows that were read with `limit + 1`: the one too many says that there are more."""
        shown = list(rows) if request.limit is None else list(rows[: request.limit])
        return Page(shown, total, key(shown[-1]) if shown and len(rows) > len(shown) else None)


def rows_to_read(request: PageRequest[KeyT]) -> int | None:
    """Return the SQL LIMIT that tells whether there are more rows."""
    return None if request.limit is None else request.limit + 1


def newest_rows(
    connection: sa.Connection, number: sa.Column[int], matching: sa.ColumnElement[bool], request: PageRequest[int]
) -> tuple[sa.ColumnElement[bool], int]:
    """Return the condition on a page's rows of a table, those with the highest numbers first, and how many match.

    A search reads every row of the table: it is made once, for the page and for the number of rows.
    """
    newest = sa.select(number).where(matching).order_by(number.desc())
    if request.search and request.limit is not None:
        numbers = list(connection.scalars(newest))
        beyond = [each for each in numbers if request.after is None or each < request.after]
        return number.in_(beyond[: rows_to_read(request)]), len(numbers)
    chosen = newest.limit(rows_to_read(request))
    if request.after is not None:
        chosen = chosen.where(number < request.after)
    total = connection.scalar(sa.select(sa.func.count()).select_from(number.table).where(matching)) or 0
    return number.in_(chosen), total


def parts_of(keys: Sequence[KeyT]) -> Iterator[Sequence[KeyT]]:
    """Yield keys in parts that fit into one statement: databases bound the number of its parameters."""
    for first in range(0, len(keys), MAX_PARAMETERS):
        yield keys[first : first + MAX_PARAMETERS]
