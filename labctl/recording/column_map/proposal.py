"""A column map proposed from a log: names, units in names, values, and steps of time."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labctl.recording.column_map.dates import instants, is_date
from labctl.recording.column_map.guesses import Guess, force_unit, means_at_rates, temperature_unit, time_unit
from labctl.recording.column_map.model import (
    QUANTITY_COLUMNS,
    ColumnMap,
    DataSets,
    FileKeys,
    MappedColumn,
    Quantity,
    UnitKeys,
)
from labctl.recording.column_map.movement import Movement, movement
from labctl.recording.column_map.names import (
    COUNTERS,
    PARTS,
    NameSays,
    as_measured_rate,
    folded,
    in_unit,
    is_bare_rate,
    is_second_choice,
    name_says,
)
from labctl.recording.column_map.units import find_unit, is_lsb, unit_of_target
from labctl.recording.columns import holds_flags
from labctl.recording.raw_table import RawColumn, RawTable

Array = NDArray[np.float64]
#: A data set of one rate has at least so many readings on average.
MIN_READINGS = 10
#: No campaign has more means than this; to read the times of a long log takes long.
MOST_MEANS = 100_000
#: A log in bursts: gaps of at least so many usual steps, and of so many seconds.
GAP_STEPS, GAP_S = 100.0, 30.0
_SEPARATORS = {"\t": "tab", " ": "space"}


Units = Mapping[Quantity, UnitKeys]


@dataclass
class Proposal:
    """A map, and in words what was guessed by values and not read from names."""

    column_map: ColumnMap
    guesses: list[str] = field(default_factory=list)


def propose(table: RawTable, serial: str | None = None, units_given: Units | None = None) -> Proposal:
    """Return a map of a log, as far as the file shows it; what it cannot show stays open and is a problem later.

    What `units_given` says of the units of a quantity is not guessed.
    """
    guesses: list[str] = []
    units_given = units_given or {}
    columns = {target: MappedColumn.of(name) for name, target in table.targets.items() if name in table.columns}
    if not columns:
        columns = _by_names(table, guesses, units_given)
    columns = {target: _in_stated(target, mapped, units_given) for target, mapped in columns.items()}
    sources_by_target = {target: table.columns[str(mapped.source)] for target, mapped in columns.items()}
    kind = "samples" if "table_rate_dps" not in columns or _is_log(columns, sources_by_target, guesses) else "points"
    _guess_force(columns, sources_by_target, guesses)
    proposed = ColumnMap(
        serial=serial or serial_of(table),
        kind="points" if kind == "points" else "samples",
        file=_file_keys(table),
        columns=columns,
        datasets=_data_sets(table, columns, sources_by_target) if kind == "samples" else DataSets(),
    )
    return Proposal(proposed, guesses)


def _is_log(
    columns: Mapping[str, MappedColumn], sources_by_target: Mapping[str, RawColumn], guesses: list[str]
) -> bool:
    """Whether the rows of a file with the table's rate are readings over time, and not means at one rate each."""
    if "t_s" not in columns:
        return False
    column, rate = sources_by_target["t_s"], sources_by_target["table_rate_dps"]
    unit = find_unit("s", columns["t_s"].unit or column.unit)
    if unit is None or rate.words is not None or len(rate.values) > MOST_MEANS:
        return True
    try:
        t_s = unit.factor * column.values if column.words is None else instants(column.words.tolist(), unit.name).t_s
    except ValueError:
        return True
    if why := means_at_rates(t_s, rate.values):
        readings = 'if they are readings, write kind = "samples" in the map'
        guesses.append(f"rows taken for means at constant rates ({why}); {readings}")
    return not why


def completed(table: RawTable, column_map: ColumnMap) -> Proposal:
    """Return a map that was given, with what it leaves to the file: columns where it names none, units by [units]."""
    if column_map.columns:
        columns = {
            target: mapped if mapped.unit else _in_stated(target, mapped, column_map.units)
            for target, mapped in column_map.columns.items()
        }
        return Proposal(column_map.model_copy(update={"columns": columns}))
    proposal = propose(table, column_map.serial, column_map.units)
    base_map = {"kind": proposal.column_map.kind, "datasets": proposal.column_map.datasets}
    changes: dict[str, Any] = {key: value for key, value in base_map.items() if key not in column_map.model_fields_set}
    columns = proposal.column_map.columns
    if column_map.sample_rate_hz is not None and "t_s" in columns and _is_open(table, columns["t_s"]):
        columns = {target: mapped for target, mapped in columns.items() if target != "t_s"}
    return Proposal(column_map.model_copy(update={**changes, "columns": columns}), proposal.guesses)


def _is_open(table: RawTable, mapped: MappedColumn) -> bool:
    """Whether the unit of a column is not known."""
    return not (mapped.unit or table.columns[str(mapped.source)].unit)


def stated_units(target: str, units_given: Units) -> UnitKeys | None:
    """Return what [units] of a map says of a column of a recording; None for nothing."""
    return next((keys for name, keys in units_given.items() if target.startswith(QUANTITY_COLUMNS[name])), None)


def _in_stated(target: str, mapped: MappedColumn, units_given: Units) -> MappedColumn:
    keys = stated_units(target, units_given)
    return mapped if keys is None else mapped.model_copy(update=keys.model_dump(exclude_unset=True))


def _by_names(table: RawTable, guesses: list[str], units_given: Units) -> dict[str, MappedColumn]:
    columns: dict[str, MappedColumn] = {}
    guesses_by_name = {name: _name_says(table, name) for name in table.columns}
    for name in sorted(
        guesses_by_name, key=lambda each: guesses_by_name[each].target == "t_s"
    ):  # a thermometer tests the unit of time
        column, says = table.columns[name], guesses_by_name[name]
        if not says.target or says.target == "dataset" or _is_counter(says.target, column):
            continue
        keys = stated_units(says.target, units_given)
        unit = keys.unit if keys is not None else column.unit or says.unit
        held = columns.get(says.target)
        if held is not None and not _takes_its_place(name, unit, says.target, held):
            continue
        if keys is not None and column.is_number:
            columns[says.target] = MappedColumn.of(name)  # what was stated is filled in later
            continue
        temperature_column = columns.get("temperature_c")
        mapped = _with_unit(name, says.target, unit, column, guesses, _celsius(table, temperature_column))
        if mapped is not None:
            columns[says.target] = mapped
    order = list(table.columns)
    return dict(sorted(columns.items(), key=lambda each: order.index(str(each[1].source))))


def _name_says(table: RawTable, name: str) -> NameSays:
    """Return what a name says: a `T` beside a column of time is a temperature."""
    unit = table.columns[name].unit
    says = in_unit(name, unit) if unit else name_says(name)
    named = {other: name_says(other).target for other in table.columns if other != name}
    others = set(named.values())
    if says.target == "t_s" and name.strip() == "T" and "t_s" in others:
        return NameSays("temperature_c", unit)
    surely_gyro = any(_is_gyro(target) and not is_bare_rate(other) for other, target in named.items())
    if _is_gyro(says.target) and is_bare_rate(name) and surely_gyro and "table_rate_dps" not in others:
        return NameSays("table_rate_dps", says.unit)
    if not says.target and "table_rate_dps" in others and any(map(_is_gyro, others)) and as_measured_rate(name):
        return in_unit(as_measured_rate(name), unit)
    return says


def _is_gyro(target: str) -> bool:
    return target.startswith("gyro_")


def _celsius(table: RawTable, mapped: MappedColumn | None) -> Array | None:
    """Return the readings of a thermometer, (n,) deg C; None where there is none in a known unit."""
    if mapped is None:
        return None
    column = table.columns[str(mapped.source)]
    unit = find_unit("deg C", mapped.unit or column.unit)
    return None if unit is None else unit.factor * column.values + unit.zero


def _with_unit(
    name: str, target: str, unit: str, column: RawColumn, guesses: list[str], temperature_c: Array | None
) -> MappedColumn | None:
    """Return the mapped column; None for one that is of no use without a known unit."""
    quantity = unit_of_target(target)
    if column.is_boolean:
        return MappedColumn.of(name) if holds_flags(target) else None
    if target == "t_s" and column.is_text:
        return MappedColumn.of(name, unit or "date-time") if _dates(column) else None
    if column.is_text:
        return MappedColumn.of(name) if target == "position" else None
    guess = Guess()
    if not unit and target == "t_s":
        guess = time_unit(column.values, temperature_c)
    elif not unit and quantity == "deg C":
        guess = temperature_unit(column.values)
    if guess.unit:
        guesses.append(f"column {name!r}: unit taken for {guess.unit} ({guess.why})")
    if guess.why and quantity == "deg C":
        return MappedColumn.of(name, guess.unit)  # where two units are possible, it is asked for
    unit = unit or guess.unit
    if quantity in {"deg C", "V", "microtesla", "deg"} and (not unit or is_lsb(unit)):
        return None  # a recording can do without it, so its unit is not asked for
    return MappedColumn.of(name, "" if is_lsb(unit) else unit)


def _takes_its_place(name: str, unit: str, target: str, held: MappedColumn) -> bool:
    """Whether a column is one of a recording rather than the one held: with a unit, or the one that is surer meant."""
    has_unit = bool(held.unit) or not unit_of_target(target)
    if not is_second_choice(name) and is_second_choice(str(held.source)):
        return bool(unit) or not has_unit
    return bool(unit) and not has_unit


def _dates(column: RawColumn) -> bool:
    return column.words is not None and is_date(str(column.words[0]))


def _is_counter(target: str, column: RawColumn) -> bool:
    if target != "t_s":
        return False
    name = folded(column.name)
    steps = np.diff(column.values)
    return COUNTERS.fullmatch(name) is not None and bool(len(steps)) and bool((steps == 1).mean() > 0.9)


def _guess_force(columns: dict[str, MappedColumn], sources_by_target: dict[str, RawColumn], guesses: list[str]) -> None:
    """Fill in the unit of the accelerometer by gravity; without one its columns are left out."""
    names = [f"accel_{axis}_g" for axis in "xyz"]
    present = [name for name in names if name in columns]
    if not present or all(columns[name].unit or sources_by_target[name].unit for name in present):
        return
    unit, scale = "", None
    if len(present) == len(names):
        force = np.column_stack([sources_by_target[name].values for name in names])
        unit, scale, evidence = force_unit(force, _still(sources_by_target, len(force)))
        if unit:
            scaled = f", {scale:g} words per g" if scale else ""
            guesses.append(f"accelerometer: unit taken for {unit}{scaled} ({evidence})")
    for name in present:
        if unit:
            columns[name] = columns[name].model_copy(update={"unit": unit, "scale": scale})
        else:
            del columns[name], sources_by_target[name]


def _still(sources_by_target: dict[str, RawColumn], n: int) -> NDArray[np.bool_]:
    """Return when the unit was still, from its accelerometer: its spread knows no unit."""
    force = np.column_stack([sources_by_target[f"accel_{axis}_g"].values for axis in "xyz"])
    size = float(np.nanmedian(np.linalg.norm(np.nan_to_num(force), axis=1))) or 1.0
    # a share of gravity of 1 % counts as 1 deg/s of a gyro: both are ten times the noise of a common sensor
    still: Movement = movement(100.0 * force / size, np.arange(n) / 100.0)
    return still.still if still.still.any() else np.ones(n, dtype=np.bool_)


def serial_of(table: RawTable) -> str:
    """Return the serial number that a file states, else its name as one."""
    stated_serial = table.facts.get("serial")
    text = str(stated_serial) if stated_serial else table.path.name.partition(".")[0]
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


def _data_sets(table: RawTable, columns: dict[str, MappedColumn], sources_by_target: dict[str, RawColumn]) -> DataSets:
    """Return the rule for data sets: a column that numbers or names them, steps of the table's rate, or bursts."""
    for name, column in table.columns.items():
        if PARTS.fullmatch(folded(name)) and _long_stretches(column):
            return DataSets(by="column", column=name)
    rate = sources_by_target.get("table_rate_dps")
    if rate is not None and _long_stretches(rate):
        return DataSets(by="column", column=rate.name)
    times = sources_by_target.get("t_s")
    if times is not None and not times.is_text and len(times.values) > 2:
        steps = np.diff(times.values)
        unit = find_unit("s", columns["t_s"].unit or times.unit)
        long = GAP_S / unit.factor if unit is not None else np.inf
        gaps = (steps > max(GAP_STEPS * float(np.median(steps)), long)).sum()
        if gaps >= 2 and "table_rate_dps" not in sources_by_target:
            return DataSets(by="gaps")
    return DataSets()


def _long_stretches(column: RawColumn) -> bool:
    values: Any = column.words if column.words is not None else column.values
    changes = int((values[1:] != values[:-1]).sum())
    return changes > 0 and len(values) >= MIN_READINGS * (changes + 1)
