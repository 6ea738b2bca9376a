"""A recording made of a log by its column map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from labctl.answers.recording_head import Motion, OutputUnit
from labctl.recording.column_map.conversion import converted, output_of
from labctl.recording.column_map.data_sets import Division, divide
from labctl.recording.column_map.dates import ORDERS
from labctl.recording.column_map.idle import idle_entries
from labctl.recording.column_map.implied import STEEPEST_K_S, steepest_k_s
from labctl.recording.column_map.model import ColumnMap
from labctl.recording.column_map.motion import free_motion, missing_columns, motion_of
from labctl.recording.column_map.movement import Movement, movement
from labctl.recording.column_map.problems import Problems, rows_text
from labctl.recording.column_map.proposal import serial_of
from labctl.recording.column_map.sources import refuse_wrong_cells, seen_as_time, sources, unused, without_headers
from labctl.recording.column_map.time_axis import TimeAxis, time_axis
from labctl.recording.column_map.units import find_unit
from labctl.recording.columns import BY_NAME, holds_flags
from labctl.recording.info import NO_DATE, RecordingInfo
from labctl.recording.raw_table import RawColumn, RawTable
from labctl.recording.recording import Recording
from labctl.recording.sanity.readings import examine

#: Readings of a thermometer that are needed, and the longest time between two, or beyond the first and last, s.
MIN_KNOWN, LONGEST_S = 2, 120.0


def is_thermometer(target: str) -> bool:
    """Whether a column of a recording holds what a thermometer reads."""
    return target.endswith("_c") and not target.endswith("_setpoint_c")


def fill_between(columns: dict[str, NDArray[np.generic]], t_s: Array, problems: Problems) -> str:
    """Fill empty cells of thermometers, at times (n,) s, by straight lines between their readings; says which.

    Before the first and after the last reading the nearest one stands. A problem where readings are too few or too far
    apart: what the temperature did between them is then not known.
    """
    filled = []
    for name in filter(is_thermometer, columns):
        values = np.asarray(columns[name], dtype=np.float64)
        is_finite = np.isfinite(values)
        n = int((~is_finite).sum())
        if n == 0:
            continue
        if is_finite.sum() < MIN_KNOWN:
            problems.add(
                f"{name}: {n} of {len(values)} cells are empty; leave the column out of the map, or fill it in"
            )
            continue
        order = np.argsort(t_s[is_finite], kind="stable")
        at, read = t_s[is_finite][order], values[is_finite][order]
        after = np.searchsorted(at, t_s)
        before_s = t_s - at[np.maximum(after - 1, 0)]
        after_s = at[np.minimum(after, len(at) - 1)] - t_s
        apart_s = np.where((after > 0) & (after < len(at)), before_s + after_s, np.abs(np.maximum(before_s, after_s)))
        far = ~is_finite & (apart_s > LONGEST_S)
        if far.any():
            problems.add(
                f"{name}, {rows_text(far)}: empty, and the thermometer was not read for "
                f"{float(apart_s[far].max()):.4g} s (at most {LONGEST_S:g} s are filled in); fill in or leave out "
                "these rows"
            )
            continue
        columns[name] = np.where(is_finite, values, np.interp(t_s, at, read))
        longest_s = float(apart_s[~is_finite].max())
        filled.append(
            f"{name}: {n} of {len(values)} cells are empty and were filled in by straight lines between the "
            f"thermometer's readings, at most {longest_s:.3g} s apart"
        )
    return "; ".join(filled)


Array = NDArray[np.float64]
#: Readings that a recording has at least.
MIN_ROWS = 2
#: Keys of recording.toml that the map has in places of its own, or that the data decide.
_TAKEN = frozenset(
    {
        "format", "serial", "axes", "kind", "motion", "started_at", "date_known", "output", "sample_rate_hz", "unread",
        "unread_share", "left_out",
    }
)  # fmt: skip
#: An instant of a file before this is that of a clock that was never set: seconds since power-on, or a simulation.
EARLIEST = datetime(1990, 1, 1, tzinfo=UTC)
#: Specific force at rest that units of g allow, g.
_AT_REST_G = (0.5, 2.0)


@dataclass(frozen=True)
class MappedLog:
    """A recording made of a log: with the motion that was found, and the file's columns that nothing uses."""

    recording: Recording
    motion: Motion
    unused: list[str]


def recording_of(table: RawTable, column_map: ColumnMap) -> MappedLog:
    """Return the recording that a map makes of a log; raises BadFile with everything that is wrong."""
    problems = Problems(table.path)
    for line in (*table.problems, *idle_entries(table, column_map)):
        problems.add(line)
    raw_columns = sources(table, column_map, problems)
    if table.rows < MIN_ROWS:
        problems.add(f"{table.rows} row of readings; a recording needs at least {MIN_ROWS}, of one unit in one run")
    if not column_map.axes:
        problems.add(
            "no column is known to be the output of a gyro (it has "
            f"{', '.join(repr(name[:40]) for name in list(table.columns)[:20])}); write [columns.gyro_x], _y or _z"
        )
    raw_columns = without_headers(raw_columns, problems)
    valid = raw_columns.get("valid")
    for target, column in raw_columns.items():
        if target == "t_s" and column.is_text and _is_date(column_map, column):
            continue
        if column.is_boolean or not _holds_text(target):
            allowed = valid is not None and target.startswith("gyro_")
            allowed |= column_map.kind == "samples" and is_thermometer(target)  # these are filled in, or refused, below
            refuse_wrong_cells(column, target, problems, empty_allowed=allowed)
    times = _times(table, column_map, raw_columns.get("t_s"), problems)
    if column_map.kind == "points" and times is None and "t_s" not in column_map.columns:
        problems.lines = [line for line in problems.lines if not line.startswith("no column of time")]
        times = TimeAxis(np.arange(table.rows, dtype=np.float64), None)
    usable = {target: column for target, column in raw_columns.items() if _is_usable(target, column)}
    columns = _columns(column_map, usable, problems)
    problems.raise_if_any()
    assert times is not None  # else a problem was raised
    return _assembled(table, column_map, usable, columns, times, problems)


def _times(table: RawTable, column_map: ColumnMap, column: RawColumn | None, problems: Problems) -> TimeAxis | None:
    if column is not None and column.is_boolean:
        return None  # that is a problem already
    return time_axis(column_map, column, table.rows, problems, seen_as_time(table) if column is None else "")


def _is_date(column_map: ColumnMap, column: RawColumn) -> bool:
    unit = find_unit("s", column_map.columns["t_s"].unit or column.unit)
    return unit is not None and unit.name in ORDERS


def _is_usable(target: str, column: RawColumn) -> bool:
    if column.is_boolean:
        return holds_flags(target)
    return not column.is_text or _holds_text(target)


def _holds_text(target: str) -> bool:
    return target in BY_NAME and BY_NAME[target].kind == "text"


def _columns(column_map: ColumnMap, sources_by_target: dict[str, RawColumn], problems: Problems) -> dict[str, Any]:
    """Return every column but time in the unit of the recording's, the gyro's in deg/s."""
    columns: dict[str, Any] = {}
    for target, column in sources_by_target.items():
        if target == "t_s":
            continue
        if _holds_text(target):
            columns[target] = column.words if column.words is not None else column.values.astype(np.str_)
            continue
        values = converted(target, column_map.columns[target], column, problems)
        if values is None:
            continue
        whole = target in BY_NAME and BY_NAME[target].kind == "integer"
        columns[target] = np.nan_to_num(values).astype(np.int64) if whole else values
    return columns


def _assembled(
    table: RawTable, column_map: ColumnMap, raw_columns: dict[str, RawColumn], columns: dict[str, Any], times: TimeAxis,
    problems: Problems,
) -> MappedLog:  # fmt: skip
    if column_map.kind == "samples" and (filled := fill_between(columns, times.t_s, problems)):
        times = replace(times, said="; ".join(filter(None, (times.said, filled))))
    problems.raise_if_any()
    rates = np.column_stack([columns[f"gyro_{axis}"] for axis in column_map.axes])
    moved = movement(rates, times.t_s)
    division = divide(table, column_map, times.t_s, moved, problems)
    if column_map.kind == "samples" or "t_s" in column_map.columns:
        columns["t_s"] = times.t_s
    columns["dataset"] = division.numbers
    _fill_constants(column_map, division, columns)
    _refuse_force(columns, moved, problems)
    _refuse_steep(column_map, columns, times.t_s, problems)
    motion = column_map.motion or motion_of(columns, column_map.kind, moved, times.t_s)
    if motion is None:
        info = _info(table, column_map, "rest", {}, times, problems)
        problems.raise_if_any()
        assert info is not None
        at_rest = [each.finding for each in examine(Recording(info, columns))]
        problems.add(free_motion(columns, moved, times.t_s, at_rest))
        problems.raise_if_any()
    assert motion is not None
    output: dict[str, OutputUnit] = {}
    for axis in column_map.axes:
        name = f"gyro_{axis}"
        columns[name], unit = output_of(column_map.columns[name], raw_columns[name])
        if unit is not None:
            output[axis] = unit
    info = _info(table, column_map, motion, output, times, problems)
    if info is not None:
        for line in missing_columns(info, columns):
            problems.add(line)
    in_data_set = division.numbers > 0
    if not in_data_set.any():
        problems.add("no row is left in any data set; correct [datasets] and [parts]")
    problems.raise_if_any()
    assert info is not None
    whole = {name: values[in_data_set] for name, values in columns.items()} if not in_data_set.all() else columns
    return MappedLog(Recording(info, whole), motion, unused(table, column_map))


def _fill_constants(column_map: ColumnMap, division: Division, columns: dict[str, Any]) -> None:
    """Fill in what the map says about all rows, then what it says about each data set."""
    n = len(division.numbers)
    for name, value in column_map.constants.constants().items():
        columns[name] = np.full(n, value)
    for number, part in division.parts(column_map).items():
        rows = division.numbers == number
        for name, value in part.constants().items():
            if name not in columns:
                columns[name] = np.full(n, "", dtype="<U2") if isinstance(value, str) else np.full(n, np.nan)
            columns[name][rows] = value
    if "turn_deg" in columns and "turn_u_deg" in columns:  # of a rest it is not used
        columns["turn_u_deg"][(columns["turn_deg"] == 0) & ~np.isfinite(columns["turn_u_deg"])] = 0.0


def _refuse_force(columns: dict[str, Any], moved: Movement, problems: Problems) -> None:
    names = [f"accel_{axis}_g" for axis in "xyz"]
    if not all(name in columns for name in names) or not moved.still.any():
        return
    force = np.column_stack([columns[name] for name in names])[moved.still]
    median = float(np.nanmedian(np.linalg.norm(force, axis=1)))
    low, high = _AT_REST_G
    if not low <= median <= high:
        problems.add(
            f"accel_x_g, accel_y_g, accel_z_g: {median:.4g} g at rest, where gravity is 1 g; check their unit or scale"
        )


def _refuse_steep(column_map: ColumnMap, columns: dict[str, Any], t_s: Array, problems: Problems) -> None:
    """Add a problem where the gyro's temperature would change faster than any does: by a wrong unit of time, mostly."""
    if column_map.kind != "samples" or "temperature_c" not in column_map.columns or "temperature_c" not in columns:
        return
    steepest = steepest_k_s(t_s, np.asarray(columns["temperature_c"], dtype=np.float64))
    if steepest > STEEPEST_K_S:
        problems.add(
            f"temperature_c: would change by {steepest:.3g} K/s (at most {STEEPEST_K_S:g} K/s are possible); check the "
            "unit of the column of time, or sample_rate_hz, and that of the temperature"
        )


def _info(
    table: RawTable, column_map: ColumnMap, motion: Motion, output: dict[str, OutputUnit], times: TimeAxis,
    problems: Problems,
) -> RecordingInfo | None:  # fmt: skip
    reserved = sorted(_TAKEN & set(column_map.info))
    if reserved:
        problems.add(
            f"[info] {reserved[0]}: this key belongs at the top level of a map, or comes from the file; leave it out "
            "here"
        )
        return None
    started = column_map.started_at or _dated(times.started_at) or _dated(table.started_at)
    head = {
        **{key: value for key, value in table.facts.items() if key not in _TAKEN},
        **column_map.info,
        "serial": column_map.serial or serial_of(table), "axes": column_map.axes, "kind": column_map.kind,
        "motion": motion,
        "started_at": started or NO_DATE, "date_known": started is not None, "output": output,
        "sample_rate_hz": column_map.sample_rate_hz,
        "notes": "; ".join(
            filter(None, (str(column_map.info.get("notes") or table.facts.get("notes") or ""), times.said))
        ),
    }  # fmt: skip
    if table.unread is not None:
        head |= {"unread": table.unread.text, "unread_share": table.unread.share}
    try:
        return RecordingInfo.model_validate(head)
    except ValidationError as error:
        for each in error.errors():
            place = ".".join(map(str, each["loc"]))
            problems.add(f"[info] {place}: {each['msg']}; correct it in the map")
        return None


def _dated(instant: datetime | None) -> datetime | None:
    """Return the instant of a file's own clock; None where the clock was not set, and counted from 1970, say."""
    return instant if instant is not None and instant >= EARLIEST else None
