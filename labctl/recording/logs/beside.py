"""Columns of further files beside those of a log, joined by time: an accelerometer that was logged on its own, say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadFile
from labctl.recording.column_map.model import ColumnMap
from labctl.recording.column_map.names import name_says
from labctl.recording.column_map.sources import source
from labctl.recording.raw_table import RawColumn, RawTable
from labctl.recording.unread import of_several

Array = NDArray[np.float64]
#: How far the nearest reading of a further file may be from a reading of the log, in its usual steps of time.
MAX_STEPS = 5.0
#: A column without a name in its file.
_NAMELESS = "column "


def joined(table: RawTable, tables: Sequence[RawTable], column_map: ColumnMap | None) -> RawTable:
    """Return a log with the columns of other files at its times, interpolated where their times are others.

    A column keeps its name; one without, or with a name that is taken, is called "STEM: NAME" by its file. The time
    column is that of the map, else the one that its name shows, and is in the same unit in all files; without one, rows
    belong together one by one. Raises BadFile for files whose times, or rows, do not belong together.
    """
    columns = dict(table.columns)
    problems = list(table.problems)
    for other in tables:
        problems += [f"{other.path.name}: {line}" for line in other.problems]
        time = _time(table, column_map, None)
        theirs = _time(other, column_map, time)
        for name, column in _at(table, time, other, theirs).items():
            if theirs is not None and name == theirs.name:
                continue
            is_taken = name in columns or name.startswith(_NAMELESS)
            called = f"{other.path.stem}: {name}" if is_taken else name
            if called in columns:
                raise _refused(
                    other,
                    f"another file has the same name and gives column {called!r} too; give the files different names",
                )
            columns[called] = replace(column, name=called)
    unread = of_several([table.unread, *(other.unread for other in tables)])
    joined_table = replace(table, columns=columns, problems=tuple(problems), first_rows=(), unread=unread)
    return joined_table if tables else table


def _time(table: RawTable, column_map: ColumnMap | None, main: RawColumn | None) -> RawColumn | None:
    """Return the column of time of a file: that of the map or of the main file, else the one that its name shows."""
    mapped = column_map.columns.get("t_s") if column_map is not None else None
    for named in (mapped.source if mapped is not None else None, main.name if main is not None else None):
        if named is not None and (raw_column := source(table, named)) is not None and raw_column.is_number:
            return raw_column
    by_target = [name for name, target in table.targets.items() if target == "t_s"]
    named_so = [name for name, column in table.columns.items() if name_says(name).target == "t_s" and column.is_number]
    return table.columns[(by_target + named_so)[0]] if by_target + named_so else None


def _at(table: RawTable, time: RawColumn | None, other: RawTable, theirs: RawColumn | None) -> dict[str, RawColumn]:
    """Return the columns of the other file in the rows of the log."""
    if time is None or theirs is None:
        if table.rows == other.rows:
            return dict(other.columns)
        without = table if time is None else other
        raise _refused(
            other,
            f"the file has {other.rows} rows and {table.path.name} has {table.rows}, but no column of "
            f"{without.path.name} is known to be the time; name the column of time in [columns.t_s], with the "
            "same name or number in both files",
        )
    if np.array_equal(time.values, theirs.values):
        return dict(other.columns)
    _refuse_apart(table, time.values, other, theirs.values)
    return {name: _interpolated(column, theirs.values, time.values) for name, column in other.columns.items()}


def _refuse_apart(table: RawTable, at: Array, other: RawTable, theirs: Array) -> None:
    """Raise BadFile where a time of the log has no reading of the other file about it."""
    steps = np.diff(theirs)
    if not (np.isfinite(at).all() and np.isfinite(theirs).all() and len(steps) and (steps > 0).all()):
        raise _refused(
            other,
            f"its times, or the times of {table.path.name}, do not increase from row to row; correct or sort the rows",
        )
    most = MAX_STEPS * float(np.median(steps))
    nearest = theirs[np.searchsorted((theirs[:-1] + theirs[1:]) / 2, at)]
    apart = np.abs(nearest - at) > most
    if apart.any():
        row = int(np.argmax(apart))
        raise _refused(
            other,
            f"there is no reading within {MAX_STEPS:.0f} steps of time {at[row]:.9g} of {table.path.name} (row "
            f"{row + 1}; {int(apart.sum())} rows without a reading): the times of the other file go from "
            f"{theirs[0]:.9g} to {theirs[-1]:.9g}, in steps of {np.median(steps):.3g}. Give both files the same clock "
            "and the same unit of time",
        )


def _interpolated(column: RawColumn, theirs: Array, at: Array) -> RawColumn:
    if column.words is not None:
        nearest = np.clip(np.searchsorted((theirs[:-1] + theirs[1:]) / 2, at), 0, len(theirs) - 1)
        return replace(column, values=column.values[nearest], words=column.words[nearest])
    return replace(column, values=np.interp(at, theirs, column.values))


def _refused(other: RawTable, line: str) -> BadFile:
    return BadFile.of(other.path, [line])
