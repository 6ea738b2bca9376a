"""A column of dates beside one of times of day: together they are the instants of the readings."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from labctl.recording.column_map.dates import is_date
from labctl.recording.column_map.names import folded
from labctl.recording.raw_table import RawColumn, RawTable

_DAY = re.compile(r"\d{4}-\d\d-\d\d|\d{4}[/.]\d{1,2}[/.]\d{1,2}|\d{1,2}[/.-]\d{1,2}[/.-]\d{4}")
_TIME_OF_DAY = re.compile(r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d+)?)?\s*(?:[AaPp][Mm])?")
#: Names of a column of dates, and of one of times of day, folded.
_DAYS = frozenset({"date", "day", "datum", "fecha", "date utc", "utc date"})
_TIMES = re.compile(r"(?:utc |local )?(?:time|clock|time of day|zeit|hora|uhrzeit|timestamp|time ?stamp)(?: utc)?")


def with_days(table: RawTable) -> tuple[RawTable, str]:
    """Return a table whose times of day have their dates in front, and what was done; the table itself where not.

    Needs one column of dates without a time, and one of times of day, by their names and in every row.
    """
    dates = [column for column in table.columns.values() if folded(column.name) in _DAYS and _all(column, _DAY)]
    times = [
        column
        for column in table.columns.values()
        if _TIMES.fullmatch(folded(column.name)) and _all(column, _TIME_OF_DAY)
    ]
    if len(dates) != 1 or len(times) != 1:
        return table, ""
    (day,), (time,) = dates, times
    assert day.words is not None
    assert time.words is not None
    words = np.array([f"{date} {_padded(clock)}" for date, clock in zip(day.words, time.words, strict=True)])
    if not is_date(str(words[0])):
        return table, ""
    joined = replace(time, words=words)
    columns = {
        name: joined if column is time else column for name, column in table.columns.items() if column is not day
    }
    done = replace(table, columns=columns, first_rows=())
    return done, f"column {day.name!r} gives the day of column {time.name!r}"


def _all(column: RawColumn, form: re.Pattern[str]) -> bool:
    if column.words is None or not len(column.words):
        return False
    return all(form.fullmatch(word.strip()) for word in np.unique(column.words).tolist())


def _padded(clock: str) -> str:
    """Return a time of day with two digits of the hour, as ISO 8601 has it."""
    text = clock.strip().replace(",", ".")
    return f"0{text}" if text[1] == ":" else text
