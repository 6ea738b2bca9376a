"""Seconds since the beginning, from any clock that a log has."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from labctl.recording.checks import LONGEST_RECORDING_S
from labctl.recording.column_map.dates import EXPECTED, ORDERS, instants
from labctl.recording.column_map.guesses import time_unit, usual_step
from labctl.recording.column_map.implied import EPOCH_S, FASTEST_HZ
from labctl.recording.column_map.model import ColumnMap
from labctl.recording.column_map.problems import Problems, rows_text
from labctl.recording.column_map.stamps import InterpolatedTimes, interpolate_between_stamps, interpolate_in_packets
from labctl.recording.column_map.units import Unit, find_unit, names_of
from labctl.recording.raw_table import RawColumn
from labctl.recording.sanity.readings.series import Series
from labctl.recording.sanity.readings.time_stamps import check_clock

Array = NDArray[np.float64]
#: Usual steps of time that a log can have, s: 50,000 readings a second to once a day.
SHORTEST_STEP_S, LONGEST_STEP_S = 1.0 / FASTEST_HZ, 86_400.0
#: A rate that a map states agrees with that of the times within this share.
RATE_WITHIN = 0.02
#: Counters that begin again, bits.
_COUNTERS = (16, 24, 32)
#: Clocks that begin again, s, and the steps within which the readings go on.
_PERIODS_S = {86_400.0: "day", 604_800.0: "week"}
_NEXT_STEPS = 3.0


@dataclass(frozen=True)
class TimeAxis:
    """Times of readings, (n,) s, the instant of their zero where the file tells it, and what was filled in or moved."""

    t_s: Array
    started_at: datetime | None
    said: str = ""


def time_axis(
    column_map: ColumnMap, column: RawColumn | None, rows: int, problems: Problems, seen: str = ""
) -> TimeAxis | None:
    """Return the times of `rows` readings; None, and a problem, where they are not known.

    `seen` says in words which column of the file looks like one of time, and why it is none.
    """
    if column is None:
        if column_map.sample_rate_hz is None:
            if "t_s" not in column_map.columns:
                problems.add(
                    f"no column of time{seen}; write [columns.t_s] with from and unit, or sample_rate_hz = readings "
                    "per second"
                )
            return None
        return TimeAxis(np.arange(rows) / column_map.sample_rate_hz, None)
    mapped = column_map.columns["t_s"]
    name = mapped.unit or column.unit
    unit = find_unit("s", name) if name else None
    if unit is None:
        problems.add(_unknown(column, rows))
        return None
    if unit.name in ORDERS:
        return _dates(column, unit.name, column_map.sample_rate_hz, problems)
    if column.is_text:
        return None
    values = column.values
    if mapped.wrap_bits is not None:
        values = np.unwrap(values, period=2.0**mapped.wrap_bits)
    counted = values * unit.factor + unit.zero
    started = None
    # a unit without "epoch" whose numbers count from 1970: no clock since power-on has run for 30 years
    if unit.is_epoch or (len(values) and EPOCH_S[0] <= counted[0] <= EPOCH_S[1]):
        started = _instant(column, float(counted[0]), problems)
        counted = (values - values[0]) * unit.factor
    axis = _finer(column, TimeAxis(counted, started), problems)
    _refuse_backwards(column, values, axis.t_s, problems, wraps=mapped.wrap_bits is None)
    _refuse_impossible(column, unit, axis.t_s, column_map.sample_rate_hz, problems)
    return axis


def _unknown(column: RawColumn, rows: int) -> str:
    readable = rows > 1 and not column.is_text
    step = usual_step(column.values) if readable else float("nan")
    implied = time_unit(column.values).why if readable else ""
    implied_text = f"; {implied}" if implied else ""
    location = "[units] or [columns.t_s] of the column map"
    return (
        f"column {column.name!r} for t_s: no unit is given (its typical step is {step:g}{implied_text}); write its "
        "unit in "
        f"{location}: one of {names_of('s').rpartition(',')[0]}"
    )


def _finer(column: RawColumn, axis_read: TimeAxis, problems: Problems) -> TimeAxis:
    """Return the times of the readings where the stamps are coarser, such as whole seconds, or of their arrival."""
    between = interpolate_between_stamps(axis_read.t_s) or interpolate_in_packets(axis_read.t_s)
    if isinstance(between, str):
        problems.add(f"column {column.name!r} (time): {between}")
    if not isinstance(between, InterpolatedTimes):
        return axis_read
    zero_s = float(between.t_s[0] - axis_read.t_s[0]) if axis_read.started_at is not None else 0.0
    started = None if axis_read.started_at is None else axis_read.started_at + timedelta(seconds=zero_s)
    reason = f"column {column.name!r}: {between.said}"
    return TimeAxis(between.t_s - (between.t_s[0] if started is not None else 0.0), started, reason)


def _instant(column: RawColumn, epoch_s: float, problems: Problems) -> datetime | None:
    try:
        return datetime(1970, 1, 1, tzinfo=UTC) + timedelta(seconds=epoch_s)
    except (OverflowError, ValueError):
        problems.add(f"column {column.name!r} for t_s: {epoch_s:g} s since 1970 is no date; check the column's unit")
        return None


def _dates(column: RawColumn, unit: str, rate_hz: float | None, problems: Problems) -> TimeAxis | None:
    words = column.words
    if words is None:
        problems.add(f"column {column.name!r} for t_s: unit = {unit!r} and the column holds numbers; check its unit")
        return None
    try:
        read = instants(words.tolist(), unit)
    except ValueError as error:
        problems.add(f"column {column.name!r} for t_s: {error}; expected {EXPECTED}")
        return None
    axis = _finer(column, TimeAxis(read.t_s, read.first), problems)
    _refuse_backwards(column, axis.t_s, axis.t_s, problems, wraps=False)
    _refuse_impossible(column, None, axis.t_s, rate_hz, problems)
    return axis


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
            else _advice_on_order(t_s)
        )
        before, after = (
            (repr(str(column.words[each])[:40]) for each in (row - 1, row))
            if column.words is not None
            else (f"{raw[each]:.12g}" for each in (row - 1, row))
        )
        problems.add(f"column {column.name!r} (time), {rows_text(wrong)}: {after} does not follow {before}; {advice}")
    elif len(steps) and t_s[-1] - t_s[0] > LONGEST_RECORDING_S:
        row = int(np.argmax(steps)) + 1
        problems.add(
            f"column {column.name!r} (time), row {row + 1}: {raw[row]:.12g} after {raw[row - 1]:.12g}; a recording "
            f"lasts at most {LONGEST_RECORDING_S:.9g} s; leave out rows with a damaged time, or check the column's unit"
        )


def _advice_on_order(t_s: Array) -> str:
    """Return what to do with times, (n,) s, that do not rise: a clock that was set back needs another remedy."""
    falls = np.flatnonzero(np.diff(t_s) <= 0) + 1
    usual = float(np.median(np.diff(t_s)))
    for period_s, name in _PERIODS_S.items():
        if len(falls) == 1 and abs(t_s[falls[0]] + period_s - t_s[falls[0] - 1]) < _NEXT_STEPS * usual:
            row = int(falls[0]) + 1
            return f"the time of {name} began again; add {period_s:g} s to the time stamps from row {row} on"
    series = Series(t_s - t_s[0], np.ones(len(t_s), dtype=np.int64), None, np.zeros(len(t_s), dtype=bool), {}, {}, {},
                    "rest")  # fmt: skip
    finding = next((marked.finding for marked in check_clock(series)), None) if np.isfinite(t_s).all() else None
    if finding is None:
        return "rows must be in the order of measurement; sort the rows, or leave these rows out"
    remedy = ", or `--leave-out time_back` does so at the import" if finding.may_leave_out else ""
    return f"{finding.said}; {finding.do}{remedy}"


def _refuse_impossible(
    column: RawColumn, unit: Unit | None, t_s: Array, rate_hz: float | None, problems: Problems
) -> None:
    """Add a problem where the usual step is impossible, or is not that of the rate which the map states."""
    usual = float(np.median(np.diff(t_s))) if len(t_s) > 1 else 1.0
    if not np.isfinite(usual) or usual <= 0:
        return
    if rate_hz is not None:  # two statements that agree prove a rate, however fast
        if abs(rate_hz * usual - 1) > RATE_WITHIN:
            problems.add(
                f"column {column.name!r} (time): {1 / usual:.6g} readings a second, where sample_rate_hz = "
                f"{rate_hz:g}; correct the unit of the column, or leave sample_rate_hz or the column out of the map"
            )
    elif not SHORTEST_STEP_S < usual <= LONGEST_STEP_S:
        unit_text = "" if unit is None else f" in {unit.name}"
        fits = "" if unit is None else time_unit(column.values).unit
        hint = f"; {fits!r} would fit" if fits and unit is not None and fits != unit.name else ""
        problems.add(
            f"column {column.name!r} (time): the usual step would be {usual:g} s{unit_text} ({SHORTEST_STEP_S:g} to "
            f"{LONGEST_STEP_S:g} s are possible); check the column's unit{hint}"
        )
