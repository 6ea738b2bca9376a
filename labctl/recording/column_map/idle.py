"""Entries of a map that would change nothing: each is a mistake of the map."""

from __future__ import annotations

from collections.abc import Iterator

from labctl.recording.column_map.model import QUANTITY_COLUMNS, ColumnMap, MappedColumn
from labctl.recording.column_map.sources import unused
from labctl.recording.column_map.units import QUANTITIES, is_lsb, unit_of_target
from labctl.recording.columns import BY_NAME
from labctl.recording.raw_table import RawTable

#: Columns of a file that a message names.
_SHOWN = 12


def idle_entries(table: RawTable, column_map: ColumnMap) -> list[str]:
    """Return a line for each entry of a map that changes nothing in what becomes of a file."""
    entries = [*_units(table, column_map), *_data_sets(column_map), *_constants(column_map)]
    for target, mapped in column_map.columns.items():
        entries += _column(target, mapped)
    layout = column_map.file.model_dump(exclude_none=True)
    if layout and table.layout is None:
        entries.append(
            f"[file] {', '.join(layout)}: the file is no text, so this changes nothing; leave [file] out of the map"
        )
    return entries


def _units(table: RawTable, column_map: ColumnMap) -> Iterator[str]:
    for quantity, keys in column_map.units.items():
        begins = QUANTITY_COLUMNS[quantity]
        targets = [target for target in column_map.columns if target.startswith(begins)]
        if not targets:
            unused_text = ", ".join(repr(name) for name in unused(table, column_map)[:_SHOWN]) or "none"
            yield (
                f"[units] {quantity} changes nothing: no column of the map is {begins}...; write which of the file's "
                f"columns these are in [columns] (not used: {unused_text}), or leave the entry out"
            )
        elif all(column_map.columns[target].unit != keys.unit for target in targets):
            yield (
                f"[units] {quantity} changes nothing: {', '.join(targets)} have units of their own in [columns]; "
                "leave one of the two out"
            )


def _column(target: str, mapped: MappedColumn) -> Iterator[str]:
    quantity, place = unit_of_target(target), f"[columns.{target}]"
    is_time = target == "t_s"
    if mapped.unit and quantity not in QUANTITIES and mapped.unit != _own_unit(target):
        yield (
            f"{place} unit = {mapped.unit!r} changes nothing: the values of this column are taken as they are; leave "
            "it out, and end the name with the unit that they have"
        )
    if (mapped.offset or mapped.at_zero) and not is_lsb(mapped.unit):
        yield f"{place} offset and at_zero change nothing without unit = 'LSB' and its scale; leave them out"
    if mapped.wrap_bits is not None and not is_time:
        yield f"{place} wrap_bits changes nothing: only t_s is a counter that begins again; leave it out"
    if is_time and (mapped.signed_bits is not None or mapped.sign == -1):
        yield f"{place} signed_bits and sign change nothing in a column of time; leave them out"


def _own_unit(target: str) -> str:
    column_spec = BY_NAME.get(target)
    return column_spec.unit if column_spec is not None else target.rpartition("_")[2]


def _data_sets(column_map: ColumnMap) -> Iterator[str]:
    rule = column_map.datasets
    if rule.gap_s is not None and rule.by != "gaps":
        yield f'[datasets] gap_s changes nothing with by = "{rule.by}"; write by = "gaps", or leave gap_s out'
    for name, part in column_map.parts.items():
        if part.rows is not None and rule.by != "rows":
            yield f'[parts.{name}] rows changes nothing with by = "{rule.by}"; write [datasets] by = "rows"'
        if part.skip and part.constants():
            yield f"[parts.{name}] {', '.join(part.constants())}: changes nothing, since its rows are left out (skip)"


def _constants(column_map: ColumnMap) -> Iterator[str]:
    in_both = sorted(set(column_map.constants.constants()) & set(column_map.columns))
    if in_both:
        yield (
            f"[constants] {', '.join(in_both)}: the map also fills this from a column of the file, which would change "
            "nothing; leave one of the two out"
        )
    if column_map.constants.rows is not None or column_map.constants.skip:
        yield "[constants] rows and skip change nothing; they belong in [parts.NAME]"
