"""Rows of a log whose time does not follow that of the row before: which they are, and the log without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.model import ColumnMap
from labctl.recording.column_map.sources import source
from labctl.recording.column_map.stamps import interpolate_between_stamps
from labctl.recording.column_map.units import find_unit
from labctl.recording.raw_table import RawTable
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.series import Series, rows_in_words
from labctl.recording.sanity.readings.time_stamps import check_clock, rows_in_order


def in_order_of_time(table: RawTable, column_map: ColumnMap) -> tuple[RawTable, Finding | None]:
    """Return a log with the most rows whose time rises from each to the next, and the finding about the others.

    The log itself, and None, where its time rises, is no column of numbers, or begins again by the map's `wrap_bits`.
    """
    mapped = column_map.columns.get("t_s")
    column = None if mapped is None else source(table, mapped.source)
    if mapped is None or column is None or not column.is_number or mapped.wrap_bits is not None:
        return table, None
    values = column.values
    if len(values) < 2 or not np.isfinite(values).all() or bool(np.all(np.diff(values) > 0)):
        return table, None
    if bool(np.all(np.diff(values) >= 0)) and interpolate_between_stamps(values - values[0]) is not None:
        return table, None  # stamps that several readings share: the times between are found when they are read
    unit = find_unit("s", mapped.unit or column.unit) if mapped.unit or column.unit else None
    n = len(values)
    series = Series(
        (values - values[0]) * (unit.factor if unit is not None else 1.0), np.ones(n, dtype=np.int64), None,
        np.zeros(n, dtype=bool), {}, {}, {}, "rest",
    )  # fmt: skip
    in_order = rows_in_order(values)
    columns = {
        name: replace(each, values=each.values[in_order], words=None if each.words is None else each.words[in_order])
        for name, each in table.columns.items()
    }
    problem = _twice(table, values, in_order) or next((marked.finding for marked in check_clock(series)), None)
    return replace(table, columns=columns, rows=int(in_order.sum()), first_rows=()), problem


def _twice(table: RawTable, values: NDArray[np.float64], is_used: NDArray[np.bool_]) -> Finding | None:
    """Return the finding about rows that repeat an earlier row with its time, (n,) times; None where others are out."""
    order = np.argsort(values, kind="stable")
    same = values[order[1:]] == values[order[:-1]]
    for column in table.columns.values():
        cells = column.values if column.is_number else column.words
        if cells is not None and len(cells) == len(values):
            same &= cells[order[1:]] == cells[order[:-1]]
    again = np.zeros(len(values), dtype=np.bool_)
    again[order[1:][same]] = True
    n = int(again.sum())
    if not n or n != int((~is_used).sum()):
        return None
    return Finding(
        "time_back", "certain", f"t_s, {rows_in_words(again)}",
        f"{n} rows repeat an earlier row with its time stamp: they were written twice",
        float(n), "rows", "one row for each reading", "leave the repeated rows out: they hold nothing new",
        channel="t_s", n=n, may_leave_out=True,
    )  # fmt: skip
