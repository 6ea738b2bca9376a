"""How a gyro's output becomes a rate, for programs without pydantic too."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple, get_args

OutputUnitName = Literal["deg/s", "rad/s", "deg/h", "V", "mV", "count", "arb"]
UNITS: frozenset[str] = frozenset(get_args(OutputUnitName))
#: Units that are rates already: what one deg/s is in them.
RATE_UNITS = {"deg/s": 1.0, "rad/s": math.pi / 180.0, "deg/h": 3600.0}


class NominalOutput(NamedTuple):
    """The nominal line of an output: rate_dps = (output - offset) / scale."""

    unit: str
    offset: float  #: output at rate 0, in `unit`
    scale: float  #: output per deg/s, in `unit` per deg/s; finite and not 0


def nominal_output(document: Mapping[str, object]) -> NominalOutput:
    """Return the line that a document states. Raises ValueError, TypeError, AttributeError for one that is no line."""
    unit = document.get("unit", "deg/s")
    if unit not in UNITS or not set(document) <= set(NominalOutput._fields):
        raise ValueError(f"{str(document)[:80]} is no output with unit, offset and scale; correct it")
    scale = document["scale"] if "scale" in document else default_scale(unit)
    line = NominalOutput(str(unit), _number(document.get("offset", 0.0)), _number(scale))
    require_usable(line.offset, line.scale)
    return line


def nominal_text(unit: str, offset: float, scale: float) -> str:
    """Return a nominal line as commands and certificates write it: scale factor 0.022 V per deg/s, 2.5 V at rest."""
    return f"scale factor {scale:.6g} {unit} per deg/s, {offset:.6g} {unit} at rest"


def _number(value: object) -> float:
    if not isinstance(value, int | float | str):
        raise TypeError(f"{str(value)[:80]} is no number; correct it")
    return float(value)


def default_scale(unit: object) -> float:
    """Return the output per deg/s in a unit of rates; raises ValueError for anything else."""
    if not isinstance(unit, str) or unit not in RATE_UNITS:
        raise ValueError(f"unit {unit!r} needs a scale: the output's change, in that unit, per deg/s")
    return RATE_UNITS[unit]


def require_usable(offset: float, scale: float) -> None:
    """Raise ValueError for numbers by which an output does not become a rate."""
    if scale == 0 or not math.isfinite(scale) or not math.isfinite(offset):
        raise ValueError(f"scale = {scale} and offset must be finite numbers, and scale must not be 0; correct them")
