"""The forms of published tables of coefficients: which columns each has, and for which model it is.

A table is of one form. It may state the standard uncertainty of each coefficient `NAME` in a column `u_NAME`, in the
same unit: of all of them, or of none.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from labctl.errors import BadRecording
from labctl.recording.info import RecordingInfo

#: Highest power of temperature in a surface, and of the rate.
TEMPERATURE_POWER, MAX_RATE_POWER = 2, 5
SCALE_OFFSET, MATRIX, SURFACE = "scale factor and offset", "matrix K and bias B", "polynomial C"
POLYNOMIALS = "polynomials in temperature"

Needed = Callable[[RecordingInfo, Collection[str]], list[str]]


@dataclass(frozen=True)
class CoefficientForm:
    """A form of table: `mark` is a column that no other form has, `needed` returns the required columns."""

    name: str
    models: tuple[str, ...]  #: presets for the model; the first is proposed
    mark: re.Pattern[str]
    needed: Needed
    also: frozenset[str] = frozenset()  #: optional columns

    def coefficients(self, info: RecordingInfo, columns: Collection[str]) -> list[str]:
        """Return the names of its columns of coefficients."""
        return [name for name in self.needed(info, columns) if self.mark.fullmatch(name)]


def _matrix(info: RecordingInfo, _: Collection[str]) -> list[str]:
    """K[output][input] in output units per deg/s, and B in output units."""
    gains = [f"k_{out}{axis}" for out in info.axes for axis in info.axes]
    return [*gains, *(f"b_{out}" for out in info.axes), "temperature_c"]


def _surface(info: RecordingInfo, columns: Collection[str]) -> list[str]:
    """Powers i of the output and j of the temperature less `reference_c`; deg/s per (deg/s)^i K^j."""
    powers = [int(matches[1]) for matches in (_CELL.fullmatch(name) for name in columns) if matches is not None]
    highest = min(max(powers, default=0), MAX_RATE_POWER)
    cells = [f"c_r{i}_t{j}" for i in range(highest + 1) for j in range(TEMPERATURE_POWER + 1)]
    axis = ["axis"] if len(info.axes) > 1 else []
    return [*axis, *cells, "reference_c", "temperature_low_c", "temperature_high_c"]


def _scale_offset(info: RecordingInfo, _: Collection[str]) -> list[str]:
    """Scale factor in output units per deg/s, offset in output units."""
    axis = ["axis"] if len(info.axes) > 1 else []
    return [*axis, "temperature_c", "scale_factor", "offset"]


def _polynomials(info: RecordingInfo, columns: Collection[str]) -> list[str]:
    """Powers of the temperature less `reference_c`: b in output units, k in output units per deg/s, each per K^j."""
    powers = {
        letter: [
            int(matches[2])
            for matches in map(_POWER.fullmatch, columns)
            if matches is not None and matches[1] == letter
        ]
        for letter in "bk"
    }
    cells = [f"b_t{j}" for j in range(min(max(powers["b"], default=0), TEMPERATURE_POWER) + 1)]
    if powers["k"]:
        cells += [f"k_t{j}" for j in range(min(max(powers["k"]), TEMPERATURE_POWER) + 1)]
    axis = ["axis"] if len(info.axes) > 1 else []
    span = ["reference_c", "temperature_low_c", "temperature_high_c"] if cells != ["b_t0"] else []
    return [*axis, *cells, *span]


_CELL = re.compile(r"c_r(\d)_t(\d)")
_POWER = re.compile(r"([bk])_t(\d)")
FORMS = (
    CoefficientForm(SURFACE, ("ojeda2000",), _CELL, _surface, frozenset({"axis"})),
    CoefficientForm(POLYNOMIALS, ("bias_scale", "bias_temperature", "bias"), _POWER, _polynomials, frozenset({"axis"})),
    CoefficientForm(MATRIX, ("yang2018", "single_temperature"), re.compile(r"k_[xyz]{2}|b_[xyz]"), _matrix),
    CoefficientForm(
        SCALE_OFFSET, ("weiss1995",), re.compile(r"scale_factor|offset"), _scale_offset, frozenset({"axis"})
    ),
)


def form_of(columns: Collection[str]) -> CoefficientForm:
    """Return the form of a table with these columns."""
    return next((form for form in FORMS if any(map(form.mark.fullmatch, columns))), FORMS[-1])


def check_coefficients(path: Path, info: RecordingInfo, columns: Mapping[str, object]) -> None:
    """Raise BadRecording for a column that the table's form lacks or does not know, and for a wrong uncertainty."""
    form = form_of(columns)
    needed = form.needed(info, columns)
    absent = [name for name in needed if name not in columns]
    if absent:
        raise BadRecording(
            f"{path}: column {absent[0]!r} is missing; a table of the form {form.name!r} with axes "
            f"{', '.join(info.axes)} has columns {', '.join(needed)}: add it"
        )
    coefficients = form.coefficients(info, columns)
    allowed = {*needed, *form.also, *(f"u_{name}" for name in coefficients)}
    unknown = sorted(set(columns) - allowed)
    if unknown:
        raise BadRecording(
            f"{path}: column {unknown[0][:80]!r} is not known in a table of the form {form.name!r}; remove or "
            f"rename it. The form has the columns {', '.join(needed)}, and u_NAME for the standard uncertainty "
            "of a coefficient. A misalignment is "
            "given as k_xy (output x per rate about y) with all of K and B"
        )
    u_columns = [f"u_{name}" for name in coefficients if f"u_{name}" in columns]
    lacking = [f"u_{name}" for name in coefficients if f"u_{name}" not in columns]
    if u_columns and lacking:
        raise BadRecording(
            f"{path}: column {lacking[0]!r} is missing, although column {u_columns[0]!r} is present; give the "
            "standard uncertainty of every coefficient, or of none"
        )
    for name in u_columns:
        _check_u(path, name, columns)


def _check_u(path: Path, name: str, columns: Mapping[str, object]) -> None:
    u = np.asarray(columns[name], dtype=np.float64)
    wrong = np.flatnonzero(~(u >= 0))
    if len(wrong):
        raise BadRecording(
            f"{path}: column {name!r}, row {wrong[0] + 1}: {u[wrong[0]]:g}; a standard uncertainty is at least 0: "
            "correct it, or leave all columns u_NAME out"
        )
