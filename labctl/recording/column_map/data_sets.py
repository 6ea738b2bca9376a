"""How the rows of a log divide into data sets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.model import ColumnMap, Part
from labctl.recording.column_map.movement import Movement, rests, stretches
from labctl.recording.column_map.problems import Problems
from labctl.recording.column_map.sources import source
from labctl.recording.raw_table import RawTable

Array = NDArray[np.float64]
Numbers = NDArray[np.int64]
#: A gap is this many usual steps of time.
GAP_STEPS = 10.0


class Division:
    """Which data set each row is of, (n,) from 1, 0 for a row that is left out; and the names that data sets have."""

    def __init__(self, numbers: Numbers, names: dict[int, str] | None = None) -> None:
        self.numbers = numbers
        self.names = names or {}

    def parts(self, column_map: ColumnMap) -> dict[int, Part]:
        """Return what the map says about each data set, by number."""
        return {number: column_map.parts[name] for number, name in self.names.items() if name in column_map.parts}


def divide(
    table: RawTable, column_map: ColumnMap, t_s: Array, movement: Movement | None, problems: Problems
) -> Division:
    """Return the data sets of a log by the rule of its map."""
    rule, n = column_map.datasets, table.rows
    if column_map.kind == "points":
        return Division(np.arange(1, n + 1))
    if rule.by == "column":
        return _by_column(table, column_map, problems)
    if rule.by == "rows":
        return _by_rows(column_map, n, problems)
    if column_map.parts:
        problems.add(f'[parts] needs [datasets] by = "column" or by = "rows" (is {rule.by!r})')
    if rule.by == "gaps":
        steps = np.diff(t_s)
        limit = rule.gap_s or GAP_STEPS * float(np.median(steps))
        return Division(np.concatenate([[1], 1 + np.cumsum(steps > limit)]).astype(np.int64))
    if rule.by == "rests" and movement is not None:
        return _by_rests(movement, t_s, leave_moves=column_map.motion in {None, "rest"})
    return Division(np.ones(n, dtype=np.int64))


def _by_column(table: RawTable, column_map: ColumnMap, problems: Problems) -> Division:
    named = column_map.datasets.column
    column = source(table, named) if named is not None else None
    if column is None:
        problems.add(f"[datasets] column {named!r} is not in the file (it has {', '.join(list(table.columns)[:20])})")
        return Division(np.ones(table.rows, dtype=np.int64))
    values: Any = column.words if column.words is not None else np.nan_to_num(column.values)
    starts = np.concatenate([[True], values[1:] != values[:-1]])
    numbers = np.cumsum(starts).astype(np.int64)
    names = {
        int(number): str(value) if column.words is not None else f"{value:g}"
        for number, value in zip(numbers[starts], values[starts], strict=True)
    }
    unknown = sorted(set(column_map.parts) - set(names.values()))
    if unknown:
        problems.add(
            f"[parts.{unknown[0]}]: column {column.name!r} has no {unknown[0]!r} (it has "
            f"{', '.join(sorted(set(names.values()))[:20])})"
        )
    skipped = [number for number, name in names.items() if name in column_map.parts and column_map.parts[name].skip]
    numbers[np.isin(numbers, skipped)] = 0
    return Division(numbers, names)


def _by_rows(column_map: ColumnMap, n: int, problems: Problems) -> Division:
    numbers, names = np.zeros(n, dtype=np.int64), {}
    for number, (name, part) in enumerate(column_map.parts.items(), start=1):
        first, last = part.rows or (0, 0)
        if not 1 <= first <= last <= n:
            problems.add(
                f"[parts.{name}] rows = [{first}, {last}]: expected 1 <= first <= last <= {n} (rows of the file)"
            )
            continue
        if numbers[first - 1 : last].any():
            problems.add(f"[parts.{name}] rows = [{first}, {last}] overlap with those of another part")
        if not part.skip:
            numbers[first - 1 : last] = number
            names[number] = name
    return Division(numbers, names)


def _by_rests(movement: Movement, t_s: Array, *, leave_moves: bool) -> Division:
    numbers, number = np.zeros(len(t_s), dtype=np.int64), 0
    resting = np.zeros(len(t_s), dtype=np.bool_)
    for first, after in rests(movement, t_s):
        resting[first:after] = True
    for first, after, still in stretches(resting):
        if leave_moves and not still:
            continue
        number += 1
        numbers[first:after] = number
    return Division(numbers)
