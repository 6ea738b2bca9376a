"""Example values of a type, made from its declaration: for tests of what has to carry every value of the type."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, date, datetime, timedelta
from enum import Enum
from pathlib import Path
from typing import Any, Literal, NotRequired, Required, Union, get_args, get_origin, get_type_hints

from typing_extensions import is_typeddict

#: Document of any form: what JSON has.
DOCUMENT = {"text": 'a "quoted"\nline, é', "list": [1, 1.5, None, True], "inner": {"empty": {}, "big": 2**53}}
PLAIN: dict[Any, tuple[object, ...]] = {
    str: ("", 'a "quoted"\nline, é \u2028'),
    int: (0, -(2**53)),
    float: (0.1, -0.0, 5e-324, 1.7976931348623157e308, float("inf"), float("nan")),
    bool: (True, False),
    bytes: (b"", b'\x00\xff{"\n\x80'),
    datetime: (datetime(2026, 1, 5, 8, 0, 0, 123456, tzinfo=UTC),),
    date: (date(2026, 2, 28),),
    timedelta: (timedelta(days=-1, microseconds=7),),
    Path: (Path("/a folder/é"),),
    types.NoneType: (None,),
    object: (DOCUMENT, 1.5, None),
    Any: (DOCUMENT,),
}


def _tuple(inner: list[list[Any]], repeats: bool) -> tuple[Any, ...]:
    return tuple(inner[0]) if repeats else tuple(each[0] for each in inner)


def _mapping(inner: list[list[Any]], _: bool) -> dict[str, Any]:
    return {f"key {n}": value for n, value in enumerate(inner[1])}


def _list(inner: list[list[Any]], _: bool) -> list[Any]:
    return inner[0]


#: Generic -> what makes one of the examples of its arguments, and whether they end with "...".
COLLECTIONS: dict[Any, Callable[[list[list[Any]], bool], Any]] = {
    tuple: _tuple, list: _list, Sequence: _list, dict: _mapping, Mapping: _mapping,
    frozenset: lambda inner, _: frozenset(inner[0]),
}  # fmt: skip


def examples(kind: Any) -> Iterator[Any]:
    """Yield values of a type, at least one for each alternative of it. Raises TypeError for a type that it has not."""
    origin, args = get_origin(kind), get_args(kind)
    if kind in PLAIN:
        yield from PLAIN[kind]
    elif origin in (Union, types.UnionType):
        for each in args:
            yield from examples(each)
    elif origin is Literal:
        yield from args
    elif origin in (NotRequired, Required) or hasattr(kind, "__metadata__"):
        yield from examples(args[0])
    elif isinstance(kind, type) and issubclass(kind, Enum):
        yield from kind
    elif origin in COLLECTIONS:
        yield COLLECTIONS[origin]([list(examples(each)) for each in args if each is not Ellipsis], Ellipsis in args)
    else:
        yield from _records(kind)


def _records(kind: Any) -> Iterator[Any]:
    """Yield records of a class with fields: together they have each example of each field."""
    made = get_origin(kind) or kind
    if is_typeddict(made):
        hints = get_type_hints(made, include_extras=True)
    elif dataclasses.is_dataclass(made):
        hints = {field.name: get_type_hints(made)[field.name] for field in dataclasses.fields(made) if field.init}
    else:
        raise TypeError(f"no example of the type {kind!r} is known; add one to examples or give the value by hand")
    values = {name: list(examples(each)) for name, each in hints.items()}
    for row in range(max(map(len, values.values()), default=1)):
        yield made(**{name: each[row % len(each)] for name, each in values.items()})
