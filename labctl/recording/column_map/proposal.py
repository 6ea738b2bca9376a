"""A column map proposed from a log: names, units in names, values, and steps of time."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.guesses import force_unit, temperature_unit, time_unit
from labctl.recording.column_map.model import QUANTITY_COLUMNS, ColumnMap, DataSets, FileKeys, MappedColumn
from labctl.recording.column_map.movement import Movement, movement
from labctl.recording.column_map.names import COUNTERS, PARTS, folded, name_says
from labctl.recording.column_map.units import find_unit, is_lsb, unit_of_target
from labctl.recording.columns import holds_flags
from labctl.recording.raw_table import RawColumn, RawTable

Array = NDArray[np.float64]
#: A data set of one rate has at least so many readings on average.
LEAST_READINGS = 10
#: A log in bursts: gaps of at least so many usual steps, and of so many seconds.
GAP_STEPS, GAP_S = 100.0, 30.0
_SEPARATORS = {"\t": "tab", " ": "space"}


@dataclass
class Proposal:
    """A map, and in words what was guessed by values and not read from names."""

    column_map: ColumnMap
    guesses: list[str] = field(default_factory=list)


def propose(table: RawTable, serial: str | None = None) -> Proposal:
    """Return a map of a log, as far as the file shows it; what it cannot show stays open and is a problem later."""
    guesses: list[str] = []
    columns = {target: MappedColumn.of(name) for name, target in table.targets.items() if name in table.columns}
    if not columns:
        columns = _by_names(table, guesses)
    found = {target: table.columns[str(mapped.source)] for target, mapped in columns.items()}
    kind = "samples" if "t_s" in columns or "table_rate_dps" not in columns else "points"
    _guess_force(columns, found, guesses)
    proposed = ColumnMap(
        serial=serial or serial_of(table),
        kind="points" if kind == "points" else "samples",
        file=_file_keys(table),
        columns=columns,
        datasets=_data_sets(table, columns, found) if kind == "samples" else DataSets(),
    )
    return Proposal(proposed, guesses)


def completed(table: RawTable, given: ColumnMap) -> Proposal:
    """Return a map that was given, with what it leaves to the file: columns where it names none, units by [units]."""
    guesses: list[str] = []
    changes: dict[str, Any] = {}
    columns = given.columns
    if not columns:
        proposal = propose(table, given.serial)
        guesses, columns = proposal.guesses, proposal.column_map.columns
        left = given.model_fields_set
        kept = {"kind": proposal.column_map.kind, "datasets": proposal.column_map.datasets}
        changes = {key: value for key, value in kept.items() if key not in left}
    for quantity, keys in given.units.items():
        begins = QUANTITY_COLUMNS[quantity]
        columns = {
            target: mapped.model_copy(update=keys.model_dump()) if target.startswith(begins) else mapped
            for target, mapped in columns.items()
        }
        guesses = [guess for guess in guesses if not guess.startswith("accelerometer" if quantity == "accel" else " ")]
    return Proposal(given.model_copy(update={**changes, "columns": columns}), guesses)


def _by_names(table: RawTable, guesses: list[str]) -> dict[str, MappedColumn]:
    columns: dict[str, MappedColumn] = {}
    for name, column in table.columns.items():
        says = name_says(name)
        if not says.target or says.target == "dataset" or _is_counter(says.target, column):
            continue
        unit = column.unit or says.unit
        mapped = _with_unit(name, says.target, unit, column, guesses)
        if mapped is None:
            continue
        held = columns.get(says.target)
        if held is None or (not _has_unit(says.target, held) and mapped.unit):
            columns[says.target] = mapped
    return columns


def _with_unit(name: str, target: str, unit: str, column: RawColumn, guesses: list[str]) -> MappedColumn | None:
    """Return the mapped column; None for one that cannot be used without a known unit."""
    quantity = unit_of_target(target)
    if column.is_boolean:
        return MappedColumn.of(name) if holds_flags(target) else None
    if target == "t_s" and column.is_text:
        return MappedColumn.of(name, "date-time") if _dates(column) else None
    if column.is_text:
        return MappedColumn.of(name) if target == "position" else None
    why = ""
    if target == "t_s":
        guessed, why = time_unit(column.values)
        if unit and not (guessed.startswith("epoch") and find_unit("s", guessed.removeprefix("epoch "))):
            why = ""
        else:
            unit = guessed
    elif quantity == "deg C" and not unit:
        unit, why = temperature_unit(column.values)
    if why:
        guesses.append(f"column {name!r}: unit taken for {unit} ({why})")
    if quantity in {"deg C", "V", "microtesla", "deg"} and (not unit or is_lsb(unit)):
        return None  # a recording can do without it, so its unit is not asked for
    return MappedColumn.of(name, "" if is_lsb(unit) else unit)


def _has_unit(target: str, mapped: MappedColumn) -> bool:
    return bool(mapped.unit) or not unit_of_target(target)


def _dates(column: RawColumn) -> bool:
    return column.words is not None and re.match(r"\d{4}-\d\d-\d\d[ T]\d\d:\d\d", str(column.words[0])) is not None


def _is_counter(target: str, column: RawColumn) -> bool:
    if target != "t_s":
        return False
    name = folded(column.name)
    steps = np.diff(column.values)
    return COUNTERS.fullmatch(name) is not None and bool(len(steps)) and bool((steps == 1).mean() > 0.9)


def _guess_force(columns: dict[str, MappedColumn], found: dict[str, RawColumn], guesses: list[str]) -> None:
    """Fill in the unit of the accelerometer by gravity; without one its columns are left out."""
    names = [f"accel_{axis}_g" for axis in "xyz"]
    there = [name for name in names if name in columns]
    if not there or all(columns[name].unit or found[name].unit for name in there):
        return
    unit, scale = "", None
    if len(there) == len(names):
        force = np.column_stack([found[name].values for name in names])
        unit, scale, why = force_unit(force, _still(found, len(force)))
        if unit:
            scaled = f", {scale:g} words per g" if scale else ""
            guesses.append(f"accelerometer: unit taken for {unit}{scaled} ({why})")
    for name in there:
        if unit:
            columns[name] = columns[name].model_copy(update={"unit": unit, "scale": scale})
        else:
            del columns[name], found[name]


def _still(found: dict[str, RawColumn], n: int) -> NDArray[np.bool_]:
    """Return when the unit was still, from its accelerometer: its spread knows no unit."""
    force = np.column_stack([found[f"accel_{axis}_g"].values for axis in "xyz"])
    size = float(np.nanmedian(np.linalg.norm(np.nan_to_num(force), axis=1))) or 1.0
    # a share of gravity of 1 % counts as 1 deg/s of a gyro: both are ten times the noise of a common sensor
    still: Movement = movement(100.0 * force / size, np.arange(n) / 100.0)
    return still.still if still.still.any() else np.ones(n, dtype=np.bool_)


def serial_of(table: RawTable) -> str:
    """Return the serial number that a file states, else its name as one."""
    given = table.facts.get("serial")
    text = str(given) if given else table.path.name.partition(".")[0]
    cleaned = re.sub(r"[^A-Za-z0-9._+# -]", "-", text)[:64].lstrip("._+# -")
    return cleaned or "unit"


def _file_keys(table: RawTable) -> FileKeys:
    layout = table.layout
    if layout is None:
        return FileKeys()
    separator: Any = _SEPARATORS.get(layout.separator, layout.separator)
    decimal: Any = layout.decimal
    encoding: Any = layout.encoding
    return FileKeys(separator=separator, decimal=decimal, header=layout.header, data=layout.data, encoding=encoding)


def _data_sets(table: RawTable, columns: dict[str, MappedColumn], found: dict[str, RawColumn]) -> DataSets:
    """Return the rule for data sets: a column that numbers or names them, steps of the table's rate, or bursts."""
    for name, column in table.columns.items():
        if PARTS.fullmatch(folded(name)) and _long_stretches(column):
            return DataSets(by="column", column=name)
    rate = found.get("table_rate_dps")
    if rate is not None and _long_stretches(rate):
        return DataSets(by="column", column=rate.name)
    times = found.get("t_s")
    if times is not None and not times.is_text and len(times.values) > 2:
        steps = np.diff(times.values)
        unit = find_unit("s", columns["t_s"].unit or times.unit)
        long = GAP_S / unit.factor if unit is not None else np.inf
        gaps = (steps > max(GAP_STEPS * float(np.median(steps)), long)).sum()
        if gaps >= 2 and "table_rate_dps" not in found:
            return DataSets(by="gaps")
    return DataSets()


def _long_stretches(column: RawColumn) -> bool:
    values: Any = column.words if column.words is not None else column.values
    changes = int((values[1:] != values[:-1]).sum())
    return changes > 0 and len(values) >= LEAST_READINGS * (changes + 1)
