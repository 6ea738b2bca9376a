"""Rows become records by the names of their columns: a missing or an additional column is an error that names it."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest
import sqlalchemy as sa

from labctl.store.repositories.records_by_name import record_of, records_of
from tests.helpers.paths import ROOT


@dataclass(frozen=True)
class Reading:
    low: float
    high: float
    unit: str = "deg/s"


@pytest.fixture
def connection() -> Iterator[sa.Connection]:
    with sa.create_engine("sqlite://").connect() as connection:
        yield connection


def select(**columns: object) -> sa.Select[Any]:
    return sa.select(*(sa.literal(value).label(name) for name, value in columns.items()))


def test_the_order_of_the_columns_does_not_matter(connection: sa.Connection) -> None:
    query = select(unit="rad/s", high=2.0, low=1.0)
    assert records_of(Reading, connection.execute(query)) == [Reading(low=1.0, high=2.0, unit="rad/s")]
    assert record_of(Reading, connection.execute(query).mappings().one()) == Reading(low=1.0, high=2.0, unit="rad/s")


def test_no_row_is_no_record(connection: sa.Connection) -> None:
    assert records_of(Reading, connection.execute(select(low=1.0, high=2.0, unit="").where(sa.false()))) == []


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"low": 1.0, "high": 2.0}, "a query for Reading lacks column unit; select"),
        ({"low": 1.0, "unit": "", "highest": 2.0}, "lacks column high and has column highest, which is no field"),
        ({"low": 1.0, "high": 2.0, "unit": "", "at": 1}, "has column at, which is no field of it; select one column"),
    ],
)
def test_a_column_that_is_missing_or_unknown_is_named(
    connection: sa.Connection, columns: dict[str, object], said: str
) -> None:
    with pytest.raises(TypeError, match=said):
        records_of(Reading, connection.execute(select(**columns)))
    with pytest.raises(TypeError, match=said):
        record_of(Reading, connection.execute(select(**columns)).mappings().one())


def test_no_record_of_the_store_is_made_of_a_row_by_place() -> None:
    by_place = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in (ROOT / "labctl" / "store").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id[:1].isupper()
        if any(isinstance(given, ast.Starred) for given in node.args)
    ]
    assert by_place == []
