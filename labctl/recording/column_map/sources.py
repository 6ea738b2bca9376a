"""The columns of a file that a map names, and what is wrong with their cells."""

from __future__ import annotations

import difflib
import re
from collections import defaultdict
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.dates import EXPECTED
from labctl.recording.column_map.model import ColumnMap
from labctl.recording.column_map.names import COUNTERS, folded, name_says
from labctl.recording.column_map.problems import Problems, rows_text
from labctl.recording.columns import holds_flags
from labctl.recording.raw_table import RawColumn, RawTable


def source(table: RawTable, column_name: str | int) -> RawColumn | None:
    """Return the column of a file by its name or its number from 1; None where there is none."""
    if isinstance(column_name, int):
        by_number = list(table.columns.values())
        exact = table.columns.get(f"column {column_name}")
        return exact or (by_number[column_name - 1] if 1 <= column_name <= len(by_number) else None)
    raw_column = table.columns.get(column_name)
    if raw_column is not None:
        return raw_column
    loose = [column for name, column in table.columns.items() if name.strip().lower() == column_name.strip().lower()]
    return loose[0] if len(loose) == 1 else None


def sources(table: RawTable, column_map: ColumnMap, problems: Problems) -> dict[str, RawColumn]:
    """Return the file's column behind each of a recording's; what is not there, or occurs twice, is a problem."""
    raw_columns: dict[str, RawColumn] = {}
    used = defaultdict(list)
    for target, mapped in column_map.columns.items():
        column = source(table, mapped.source)
        if column is None:
            problems.add(_not_there(table, mapped.source, target))
            continue
        raw_columns[target] = column
        used[column.name].append(target)
    for name, targets in used.items():
        if len(targets) > 1 and any(target.startswith(("gyro_", "accel_")) for target in targets):
            problems.add(f"column {name!r} is mapped to {' and '.join(targets)}; each needs a column of its own")
    return raw_columns


def unused(table: RawTable, column_map: ColumnMap) -> list[str]:
    """Return the columns of a file that a map does not use, in the file's order."""
    named = [mapped.source for mapped in column_map.columns.values()]
    named += [column_map.datasets.column] if column_map.datasets.column is not None else []
    used = {column.name for each in named if (column := source(table, each)) is not None}
    return [name for name in table.columns if name not in used]


def seen_as_time(table: RawTable) -> str:
    """Return in words which column of a file looks like one of time and is none, in brackets; empty for no such."""
    for name, column in table.columns.items():
        if name_says(name).target == "t_s" and column.words is not None and len(column.words):
            first = next((word[:40] for word in column.words.tolist() if not _is_number(word)), "")
            return f" (column {name[:40]!r} holds texts such as {first!r}; expected {EXPECTED})"
        if COUNTERS.fullmatch(folded(name)) and column.is_number and bool((np.diff(column.values) == 1).all()):
            return f" (column {name[:40]!r} counts the readings, at a rate that the file does not state)"
    return ""


def _is_number(word: str) -> bool:
    return re.fullmatch(r"[+-]?[\d.]+(?:[eE][+-]?\d+)?", word.strip()) is not None


def without_headers(raw_columns: dict[str, RawColumn], problems: Problems) -> dict[str, RawColumn]:
    """Return columns without the cells that repeat their own name, which are one problem: a second file's header."""
    repeated = [
        {row for row, text in column.wrong if text.strip() == column.name.strip()} for column in raw_columns.values()
    ]
    rows = sorted(set.intersection(*repeated)) if repeated else []
    if not rows:
        return raw_columns
    problems.add(
        f"{rows_text(rows)}: the names of the columns again, as where logs were joined; import each part as a file of "
        "its own, or leave these rows out"
    )
    return {
        target: replace(
            column,
            wrong=tuple(each for each in column.wrong if each[0] not in rows),
            n_wrong=column.n_wrong - len(rows),
            values=_bridged(column.values, np.array(rows) - 1),
        )
        for target, column in raw_columns.items()
    }


def _bridged(values: NDArray[np.float64], at: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (n,) values with those at some rows on a straight line between their neighbours."""
    others = np.setdiff1d(np.arange(len(values)), at)
    bridged = values.copy()
    bridged[at] = np.interp(at, others, values[others])
    return bridged


def refuse_wrong_cells(column: RawColumn, target: str, problems: Problems, *, empty_allowed: bool) -> None:
    """Add a problem for cells that are no numbers, and one for empty cells where none may be."""
    if column.is_boolean and not holds_flags(target):
        problems.add(
            f"column {column.name!r} (for {target}) holds true and false; expected readings; name another column in "
            "the map, or leave this one out"
        )
        return
    if column.words is not None:
        problems.add(
            f"column {column.name!r} (for {target}) holds text, such as {str(column.words[0])[:40]!r}; expected "
            "numbers; correct the map, or the separator and the decimal sign in [file]"
        )
        return
    if column.n_wrong:
        texts = ", ".join(repr(text[:40]) for _, text in column.wrong[:3])
        rows = rows_text([row for row, _ in column.wrong], column.n_wrong)
        comma = ' (a decimal comma? write decimal = "," in [file])' if any("," in t for _, t in column.wrong) else ""
        problems.add(f"column {column.name!r}, {rows}: {texts} is no number{comma}; correct or leave out these rows")
    missing = ~np.isfinite(column.values)
    for row, _ in column.wrong:
        missing[row - 1] = False
    if missing.any() and not empty_allowed and int(missing.sum()) > column.n_wrong - len(column.wrong):
        problems.add(
            f"column {column.name!r} (for {target}), {rows_text(missing)}: empty or no finite number; fill in or leave "
            "out these rows"
        )


def _not_there(table: RawTable, column_name: str | int, target: str) -> str:
    names = list(table.columns)
    near = difflib.get_close_matches(str(column_name), names, n=1, cutoff=0.6)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    listed = ", ".join(repr(name[:40]) for name in names[:20]) + (" ..." if len(names) > 20 else "")
    column_text = f"number {column_name}" if isinstance(column_name, int) else repr(column_name[:60])
    return f"column {column_text} (for {target}) is not in the file{hint} (it has {listed})"
