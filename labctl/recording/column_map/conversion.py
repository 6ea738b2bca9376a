"""Columns of a file in the units of a recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import OutputUnit
from labctl.recording.column_map.guesses import temperature_unit
from labctl.recording.column_map.model import MappedColumn
from labctl.recording.column_map.problems import Problems, rows_text
from labctl.recording.column_map.units import QUANTITIES, find_unit, is_lsb, names_of, unit_of_target
from labctl.recording.raw_table import RawColumn

Array = NDArray[np.float64]
#: Beyond this no gyro turns, deg/s.
LARGEST_RATE_DPS = 1e5
#: What no thermometer of a gyro shows, deg C.
COLDEST_C, HOTTEST_C = -273.15, 1000.0


def unit_name(mapped: MappedColumn, column: RawColumn) -> str:
    """Return the unit that the map says, else that of the format."""
    return mapped.unit or column.unit


def words_of(mapped: MappedColumn, column: RawColumn) -> Array:
    """Return the numbers of a column, (n,), words without sign as signed ones where the map says so."""
    values = column.values
    if mapped.signed_bits is not None:
        span = 2.0**mapped.signed_bits
        values = np.where(values >= span / 2, values - span, values)
    return values


def converted(target: str, mapped: MappedColumn, column: RawColumn, problems: Problems) -> Array | None:
    """Return a column in the unit of the recording's column, (n,); None, and a problem, where its unit is not known."""
    values = words_of(mapped, column)
    quantity = unit_of_target(target)
    if quantity not in QUANTITIES:
        return mapped.sign * values
    name = unit_name(mapped, column)
    if is_lsb(name):
        if mapped.scale is None:
            problems.add(
                _unknown_unit(target, column, quantity, "the unit is LSB of a converter, but no scale is given")
            )
            return None
        return mapped.at_zero + mapped.sign * (values - mapped.offset) / mapped.scale
    unit = find_unit(quantity, name) if name else None
    if unit is None:
        implied = temperature_unit(column.values).why if quantity == "deg C" and not name else ""
        reason = f"unit {name!r} is not known" if name else "no unit is given" + (f" ({implied})" if implied else "")
        problems.add(_unknown_unit(target, column, quantity, reason))
        return None
    converted_values = mapped.sign * (unit.factor * values + unit.zero)
    _refuse_impossible(target, column, converted_values, quantity, problems)
    return converted_values


def output_of(mapped: MappedColumn, column: RawColumn) -> tuple[Array, OutputUnit | None]:
    """Return a gyro's output as the recording keeps it, (n,), and its unit; None for deg/s.

    Words of a converter, rad/s and deg/h stay what they are; anything else becomes deg/s.
    """
    values, name = words_of(mapped, column), unit_name(mapped, column)
    if is_lsb(name) and mapped.scale is not None:
        # at_zero + sign (w - offset) / scale = (w - (offset - sign at_zero scale)) / (sign scale)
        scale = mapped.sign * mapped.scale
        return values, OutputUnit(unit="count", scale=scale, offset=mapped.offset - mapped.at_zero * scale)
    unit = find_unit("deg/s", name)
    if unit is not None and unit.name == "rad/s":
        return mapped.sign * values, OutputUnit.model_validate({"unit": "rad/s"})
    if unit is not None and unit.name == "deg/h":
        return mapped.sign * values, OutputUnit.model_validate({"unit": "deg/h"})
    return mapped.sign * (unit.factor if unit is not None else 1.0) * values, None


def _unknown_unit(target: str, column: RawColumn, quantity: str, reason: str) -> str:
    finite = column.values[np.isfinite(column.values)]
    span = f" ({finite.min():.4g} to {finite.max():.4g})" if len(finite) else ""
    place = f"[units] or [columns.{target}]"
    return (
        f"column {column.name!r}{span} for {target}: {reason}; write its unit in {place}: one of {names_of(quantity)}"
    )


def _refuse_impossible(target: str, column: RawColumn, values: Array, quantity: str, problems: Problems) -> None:
    low, high = -np.inf, np.inf
    if quantity == "deg C":
        low, high = COLDEST_C, HOTTEST_C
    elif quantity == "deg/s":
        low, high = -LARGEST_RATE_DPS, LARGEST_RATE_DPS
    wrong = (values < low) | (values > high)
    if wrong.any():
        row = int(np.argmax(wrong))
        problems.add(
            f"column {column.name!r} (for {target}), {rows_text(wrong)}: {values[row]:.6g} {quantity} is not possible "
            f"({low:g} to {high:g}); check the column's unit"
        )
