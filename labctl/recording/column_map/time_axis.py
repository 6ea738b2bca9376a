"""Seconds since the beginning, from any clock that a log has."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from labctl.recording.checks import LONGEST_RECORDING_S
from labctl.recording.column_map.model import ColumnMap
from labctl.recording.column_map.problems import Problems, rows_text
from labctl.recording.column_map.units import find_unit, names_of
from labctl.recording.raw_table import RawColumn

Array = NDArray[np.float64]
#: Usual steps of time that a log can have, s: 1 MHz to once a day.
SHORTEST_STEP_S, LONGEST_STEP_S = 1e-6, 86_400.0
#: Counters that begin again, bits.
_COUNTERS = (16, 24, 32)


@dataclass(frozen=True)
class TimeAxis:
    """Times of readings, (n,) s, and the instant of their zero where the file tells it."""

    t_s: Array
    started_at: datetime | None


def time_axis(column_map: ColumnMap, column: RawColumn | None, rows: int, problems: Problems) -> TimeAxis | None:
    """Return the times of `rows` readings; None, and a problem, where they are not known."""
    if column is None:
        if column_map.sample_rate_hz is None:
            if "t_s" not in column_map.columns:
                problems.add(
                    "no column of time; write [columns.t_s] with from and unit, or sample_rate_hz = readings per second"
                )
            return None
        return TimeAxis(np.arange(rows) / column_map.sample_rate_hz, None)
    mapped = column_map.columns["t_s"]
    name = mapped.unit or column.unit
    unit = find_unit("s", name) if name else None
    if unit is None:
        step = float(np.median(np.diff(column.values))) if rows > 1 and not column.is_text else float("nan")
        problems.add(
            f"column {column.name!r} for t_s: no unit is given (its typical step is {step:g}); write its unit in "
            f"[units] or [columns.t_s] of the column map: one of {names_of('s').rpartition(',')[0]}"
        )
        return None
    if unit.name == "date-time":
        return _dates(column, problems)
    if column.is_text:
        return None
    values = column.values
    if mapped.wrap_bits is not None:
        values = np.unwrap(values, period=2.0**mapped.wrap_bits)
    if unit.is_epoch:
        zero = float(values[0]) * unit.factor
        started = _instant(column, zero, problems)
        found = TimeAxis((values - values[0]) * unit.factor, started)
    else:
        found = TimeAxis(values * unit.factor, None)
    _refuse_backwards(column, values, found.t_s, problems, wraps=mapped.wrap_bits is None)
    return found


def _instant(column: RawColumn, epoch_s: float, problems: Problems) -> datetime | None:
    try:
        return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=epoch_s)
    except (OverflowError, ValueError):
        problems.add(f"column {column.name!r} for t_s: {epoch_s:g} s since 1970 is no date; check the column's unit")
        return None


def _dates(column: RawColumn, problems: Problems) -> TimeAxis | None:
    words = column.words
    if words is None:
        problems.add(f"column {column.name!r} for t_s: unit = 'date-time' and the column holds numbers; check its unit")
        return None
    try:
        naive = np.array([_utc(word) for word in words.tolist()], dtype="datetime64[us]")
    except ValueError as error:
        problems.add(f"column {column.name!r} for t_s: {error}; expected dates such as 2026-01-05T08:00:00.250Z")
        return None
    t_s = (naive - naive[0]) / np.timedelta64(1, "s")
    started = naive[0].astype(datetime).replace(tzinfo=UTC)
    _refuse_backwards(column, t_s, t_s, problems, wraps=False)
    return TimeAxis(t_s, started)


def _utc(word: str) -> datetime:
    found = datetime.fromisoformat(word)
    return found.astimezone(UTC).replace(tzinfo=None) if found.tzinfo else found


def _refuse_backwards(column: RawColumn, raw: Array, t_s: Array, problems: Problems, *, wraps: bool) -> None:
    steps = np.diff(t_s)
    wrong = np.concatenate([[False], steps <= 0])
    if wrong.any():
        row = int(np.argmax(wrong))
        fall = float(raw[row - 1] - raw[row])
        bits = next((bits for bits in _COUNTERS if wraps and 0.9 * 2.0**bits < fall <= 2.0**bits), None)
        advice = (
            f"a counter of {bits} bits that began again? write wrap_bits = {bits} in [columns.t_s]"
            if bits is not None
            else "rows must be in the order of measurement, each later than the row before; sort the rows, or leave "
            "these rows out"
        )
        problems.add(
            f"column {column.name!r} (time), {rows_text(wrong)}: {raw[row]:.12g} does not follow "
            f"{raw[row - 1]:.12g}; {advice}"
        )
    elif len(steps) and t_s[-1] - t_s[0] > LONGEST_RECORDING_S:
        row = int(np.argmax(steps)) + 1
        problems.add(
            f"column {column.name!r} (time), row {row + 1}: {raw[row]:.12g} after {raw[row - 1]:.12g}; a recording "
            f"lasts at most {LONGEST_RECORDING_S:.9g} s; leave out rows with a damaged time, or check the column's unit"
        )
    usual = float(np.median(steps)) if len(steps) else 1.0
    if np.isfinite(usual) and usual > 0 and not SHORTEST_STEP_S <= usual <= LONGEST_STEP_S:
        problems.add(
            f"column {column.name!r} (time): the usual step would be {usual:g} s ({SHORTEST_STEP_S:g} to "
            f"{LONGEST_STEP_S:g} s are possible); check the column's unit"
        )
