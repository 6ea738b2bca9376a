"""Requirements on the content of a recording, and the defaults of its optional columns."""

from __future__ import annotations

from pathlib import Path
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.coefficient_forms import check_coefficients
from labctl.recording.columns import BY_NAME, ENVIRONMENT_NEEDED, VERIFICATION, needed
from labctl.recording.data_set_limits import refuse_large_numbers, refuse_too_many_data_sets
from labctl.recording.info import RecordingInfo
from labctl.recording.motions.constant_rate import rate_change
from labctl.recording.motions.turns import check_turns, mean_rate_dps
from labctl.recording.positions import EXPECTED, Position
from labctl.recording.recording import Column
from labctl.texts import control_character

#: Possible ranges: a value outside is in another unit, or wrong.
POSSIBLE = {"table_rate_dps": (-1e5, 1e5), "temperature_c": (-273.15, 1000.0), "chamber_c": (-273.15, 1000.0)}
#: Largest size of a value: the square of a larger one, as a spread needs it, may overflow.
LARGEST = 1e100
#: A recording of more than three years has a damaged time stamp; its gap would be resampled as if it were real, s.
LONGEST_RECORDING_S = 1e8
#: The refusal of a recording of free motion.
NO_REFERENCE = (
    "column 'table_rate_dps' is missing, so the rate of the unit is not known, and free motion alone cannot "
    "calibrate a gyro; write motion = 'rest' for a unit at rest, 'turns' with column turn_deg for turns by known "
    "angles, or 'poses' with "
    "columns accel_x_g, accel_y_g and accel_z_g for turns by hand between rests"
)


def checked(path: Path, info: RecordingInfo, columns: dict[str, Column]) -> dict[str, Column]:
    """Return the columns with the format's defaults filled in; raises BadRecording on the first thing that is wrong."""
    _require_texts(path, info)
    _require_datasheet(path, info)
    for name in needed(info):
        if name not in columns:
            raise _missing(path, info, name)
        _require_finite(path, name, columns[name], columns.get("valid"))
    for name, (low, high) in POSSIBLE.items():
        if name in columns:
            _require_possible(path, name, np.asarray(columns[name], dtype=np.float64), low, high)
    for name, values in columns.items():
        _require_squarable(path, name, values, columns.get("valid"))
    refuse_large_numbers(path, columns)
    if info.kind == "coefficients":
        check_coefficients(path, info, columns)
        return columns
    refuse_too_many_data_sets(path, info, columns)
    if "t_s" in columns:
        _require_rising_time(path, np.asarray(columns["t_s"], dtype=np.float64), strict=info.kind == "samples")
    _require_datasets(path, np.asarray(columns["dataset"], dtype=np.int64), points=info.kind == "points")
    if info.kind == "samples" and info.motion == "rates":
        _require_one_rate(path, columns)
    _require_one_mark(path, info, columns)
    if info.motion == "turns":
        check_turns(path, info, columns)
    return _defaults(path, info, columns)


def _missing(path: Path, info: RecordingInfo, name: str) -> BadRecording:
    if name == "table_rate_dps" and info.motion == "rates":
        return BadRecording(f"{path}: {NO_REFERENCE}")
    return BadRecording(
        f"{path}: column {name!r} is missing; add it (needed for kind = {info.kind!r}, motion = {info.motion!r}: "
        f"{BY_NAME[name].meaning})"
    )


def _require_possible(path: Path, name: str, values: NDArray[np.float64], low: float, high: float) -> None:
    wrong = (values < low) | (values > high)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise BadRecording(
            f"{path}: column {name!r}, row {row + 1}: {values[row]:g} is outside the possible range of {low:g} "
            f"to {high:g} {BY_NAME[name].unit}; check the column's unit"
        )


def _require_squarable(path: Path, name: str, values: Column, valid: Column | None) -> None:
    if not _are_floats(values) or not values.size:
        return
    if max(np.nanmax(values, initial=0.0), -np.nanmin(values, initial=0.0)) <= LARGEST:
        return
    wrong = np.abs(values) > LARGEST
    if valid is not None and name.startswith("gyro_"):
        wrong &= valid != 0
    if wrong.any():
        row = int(np.argmax(wrong))
        raise BadRecording(
            f"{path}: column {name[:80]!r}, row {row + 1}: {values[row]:g} is larger than {LARGEST:g}, the "
            "largest value that labctl accepts; check the column's unit"
        )


def _are_floats(values: Column) -> TypeGuard[NDArray[np.floating]]:
    return values.dtype.kind == "f"


def checked_environment(path: Path, columns: dict[str, Column]) -> dict[str, Column]:
    """Return the environment's columns; raises BadRecording when time or temperature is missing or not in order."""
    for name in ENVIRONMENT_NEEDED:
        if name not in columns:
            raise BadRecording(f"{path}: column {name!r} is missing; add it")
        _require_finite(path, name, columns[name], None)
    for name, values in columns.items():
        _require_squarable(path, name, values, None)
    _require_rising_time(path, np.asarray(columns["t_s"], dtype=np.float64), strict=False)
    refuse_large_numbers(path, columns)
    columns.setdefault("run", np.ones(len(columns["t_s"]), dtype=np.int64))
    return columns


def _require_finite(path: Path, name: str, values: Column, valid: Column | None) -> None:
    if values.dtype.kind != "f":
        return
    bad = ~np.isfinite(values)
    if valid is not None and name.startswith("gyro_"):
        bad &= valid != 0  # an instrument may send no number with a reading that it marks as bad
    if bad.any():
        row = int(np.argmax(bad))
        raise BadRecording(
            f"{path}: column {name!r}, row {row + 1}: {values[row]} is not a number (the column is the "
            f"{BY_NAME[name].meaning.removeprefix('the ')}); leave the row out, or mark it with valid = 0"
        )


def _require_rising_time(path: Path, t_s: NDArray[np.float64], *, strict: bool) -> None:
    steps = np.diff(t_s)
    back = steps <= 0 if strict else steps < 0
    if back.any():
        row = int(np.argmax(back)) + 1
        raise BadRecording(
            f"{path}: column 't_s', row {row + 1}: {t_s[row]:.9g} s does not follow {t_s[row - 1]:.9g} s "
            "of the row before; sort the rows in the order of measurement"
        )
    span_s = float(t_s[-1] - t_s[0]) if len(t_s) else 0.0
    if span_s > LONGEST_RECORDING_S:
        row = int(np.argmax(steps)) + 1
        raise BadRecording(
            f"{path}: column 't_s', row {row + 1}: {t_s[row]:.9g} s after {t_s[row - 1]:.9g} s in the row before; a "
            f"recording lasts at most {LONGEST_RECORDING_S:.9g} s; leave out rows with a damaged time, or divide the "
            "recording"
        )


def _require_datasets(path: Path, dataset: NDArray[np.int64], *, points: bool) -> None:
    starts = np.flatnonzero(np.concatenate([[True], dataset[1:] != dataset[:-1]]))
    numbers = dataset[starts] if not points else dataset
    rows = starts if not points else np.arange(len(dataset))
    _, first = np.unique(numbers, return_index=True)
    if len(first) != len(numbers):
        again = int(np.setdiff1d(np.arange(len(numbers)), first)[0])
        raise BadRecording(
            f"{path}: column 'dataset', row {rows[again] + 1}: number {numbers[again]} is repeated; give each data "
            "set one number and consecutive rows"
        )


def _require_one_rate(path: Path, columns: dict[str, Column]) -> None:
    rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(rate), dtype=bool)
    change = rate_change(np.asarray(columns["dataset"], dtype=np.int64), rate, valid)
    if change is not None:
        raise BadRecording(
            f"{path}: column 'table_rate_dps', row {change.row + 1}: {change.after_dps:g} deg/s in data set "
            f"{change.dataset}, which began at {change.before_dps:g} deg/s; a data set has one rate: give the "
            "readings at another rate a separate data set number, or mark them with valid = 0"
        )


def _require_texts(path: Path, info: RecordingInfo) -> None:
    for name, text in (
        ("model", info.model), ("active_calibration", info.active_calibration), ("notes", info.notes),
        ("thermometer", info.thermometer),
    ):  # fmt: skip
        if control := control_character(text, lines=name == "notes"):
            raise BadRecording(f"{path}: {name} has a control character ({control}); write it without")


def _require_datasheet(path: Path, info: RecordingInfo) -> None:
    for name, value in info.datasheet.items():
        if not 0.0 <= value < LARGEST:  # also true for NaN
            raise BadRecording(
                f"{path}: datasheet.{name} = {value}: give a number that is not negative, or leave it out"
            )


def _require_one_mark(path: Path, info: RecordingInfo, columns: dict[str, Column]) -> None:
    """Raise BadRecording for a mark other than 0 and 1, one that changes within a data set, or any in poses."""
    if VERIFICATION not in columns:
        return
    if info.motion == "poses":
        raise BadRecording(
            f"{path}: column {VERIFICATION!r}: a recording in poses has no data sets that could be kept from a fit; "
            "leave the column out, and verify with another recording (`labctl verify --recording`)"
        )
    marks, dataset = np.asarray(columns[VERIFICATION]), np.asarray(columns["dataset"])
    wrong = (marks != 0) & (marks != 1)
    changes = np.concatenate([[False], (marks[1:] != marks[:-1]) & (dataset[1:] == dataset[:-1])])
    if not (wrong | changes).any():
        return
    row = int(np.argmax(wrong | changes))
    fault = "is not 0 or 1" if wrong[row] else f"differs from {marks[row - 1]} in the row before, of the same data set"
    raise BadRecording(
        f"{path}: column {VERIFICATION!r}, row {row + 1}: {marks[row]} {fault}; give every row of a data set 1 if it "
        "was measured to verify a calibration, else 0"
    )


def _defaults(path: Path, info: RecordingInfo, columns: dict[str, Column]) -> dict[str, Column]:
    n = len(columns["dataset"])
    if info.motion == "rest":
        columns.setdefault("table_rate_dps", np.zeros(n))
        _refuse_unknown_up(path, info, columns)
    if info.motion == "turns":
        columns["table_rate_dps"] = mean_rate_dps(info, columns)
    if "position" not in columns:
        columns["position"] = np.full(n, info.axes[0])
    columns["position"] = _positions(path, columns["position"])
    columns.setdefault("run", np.ones(n, dtype=np.int64))
    if "mounting" not in columns:
        changed = (columns["run"][1:] != columns["run"][:-1]) | (columns["position"][1:] != columns["position"][:-1])
        columns["mounting"] = np.concatenate([[1], 1 + np.cumsum(changed)]).astype(np.int64)
    if "power_s" not in columns and info.power_on_s is not None and "t_s" in columns and (columns["run"] == 1).all():
        columns["power_s"] = np.asarray(columns["t_s"], dtype=np.float64) - info.power_on_s
    return columns


def _refuse_unknown_up(path: Path, info: RecordingInfo, columns: dict[str, Column]) -> None:
    if "position" not in columns and len(info.axes) > 1 and info.latitude_deg is not None:
        raise BadRecording(
            f"{path}: column 'position' is missing, but latitude_deg = {info.latitude_deg:g} is given: to subtract "
            "the Earth's rate labctl needs the body axis that points up; add the column, or leave latitude_deg out"
        )


def _positions(path: Path, position: Column) -> Column:
    """Return positions in their normal form: `x@0` becomes x."""
    words, of = np.unique(position, return_inverse=True)
    unknown = []
    for word in words:
        try:
            unknown.append(str(Position.of(str(word))))
        except ValueError:
            row = int(np.argmax(position == word))
            raise BadRecording(
                f"{path}: column 'position', row {row + 1}: {str(word)!r} is not a position (expected {EXPECTED})"
            ) from None
    return np.array(unknown, dtype=np.str_)[of]
