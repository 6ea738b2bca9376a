"""Rows of the database as records: each column goes to the field of its name, never by its place."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import fields
from typing import TYPE_CHECKING, TypeVar, TypeVarTuple

import sqlalchemy as sa

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

RecordT = TypeVar("RecordT", bound="DataclassInstance")
ColumnTs = TypeVarTuple("ColumnTs")


def records_of(kind: type[RecordT], result: sa.Result[*ColumnTs]) -> list[RecordT]:
    """Return the rows of a query as records. Raises TypeError where its columns are not the record's fields."""
    names = list(result.keys())
    _check_columns(kind, names)
    make: Callable[..., RecordT] = kind
    # a mapping for each row takes twice as long
    return [make(**dict(zip(names, tuple[object, ...](row), strict=True))) for row in result]


def record_of(kind: type[RecordT], row: sa.RowMapping) -> RecordT:
    """Return a row, as a mapping, as a record. Raises TypeError where its columns are not the record's fields."""
    _check_columns(kind, list(row))
    make: Callable[..., RecordT] = kind
    return make(**row)


def _check_columns(kind: type[RecordT], columns: Iterable[object]) -> None:
    present, wanted = [str(name) for name in columns], [field.name for field in fields(kind)]
    missing, unknown = (
        [name for name in wanted if name not in present],
        [name for name in present if name not in wanted],
    )
    if missing or unknown:
        problems = [f"lacks column {', '.join(missing)}"] if missing else []
        problems += [f"has column {', '.join(unknown)}, which is no field of it"] if unknown else []
        raise TypeError(
            f"a query for {kind.__name__} {' and '.join(problems)}; select one column for each field, and label it so"
        )
