"""A calibration as a table to look the error up in, linear between its points in output and temperature.

The error of an axis is the sum, over all axes, of the entry at the output of each: exact for models whose axes act
through a matrix. What the sum misses in other models is part of the stated difference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.calibration import Calibration
from labctl.exports.comments import commented, head_lines
from labctl.exports.format import Format, Written
from labctl.exports.options import whole_number
from labctl.exports.static_part import StaticPart, all_turning, needs_thermometer, static_part
from labctl.fitting.numeric.arrays import Array

NAME = "table-csv"
COLUMNS = "axis,by_axis,output_dps,temperature_c,error_dps"
OUTPUTS, TEMPERATURES, MOST = 41, 41, 501
#: Each mesh is compared in so many parts, in both directions.
REFINED = 4


@dataclass(frozen=True)
class Table:
    """Errors, (axes, by axes, outputs, temperatures) deg/s, at outputs (m,) deg/s and temperatures (n,) deg C."""

    outputs: Array
    temperatures_c: Array
    errors: NDArray[np.float64]

    def error_dps(self, raw: Array, temperature_c: Array) -> Array:
        """Return the error, (n, axes), of outputs (n, axes) at temperatures (n,)."""
        error = np.zeros_like(raw)
        for axis, by in np.ndindex(self.errors.shape[:2]):
            error[:, axis] += _bilinear(
                self.errors[axis, by], self.outputs, self.temperatures_c, raw[:, by], temperature_c
            )
        return error


def table_of(part: StaticPart, outputs: Array, temperatures_c: Array) -> Table:
    """Return what each axis' output adds to each axis' error; the error at outputs of 0 is in the axis' own."""
    m, n, axes = len(outputs), len(temperatures_c), len(part.axes)
    temperature_c = np.tile(temperatures_c, m)
    still = -part.rate(np.zeros((n, axes)), temperatures_c)
    errors = np.zeros((axes, axes, m, n))
    for by in range(axes):
        raw = np.zeros((m * n, axes))
        raw[:, by] = np.repeat(outputs, n)
        error = (raw - part.rate(raw, temperature_c)).reshape(m, n, axes)
        for axis in range(axes):
            errors[axis, by] = error[:, :, axis] - (0.0 if axis == by else still[:, axis])
    return Table(outputs, temperatures_c, errors)


def largest_difference(part: StaticPart, table: Table) -> float:
    """Return how far the table is from the calibration at most, deg/s: between its points, and where all axes turn."""
    fine = [_refined(table.outputs), part.with_kinks(_refined(table.temperatures_c))]
    exact = table_of(part, *fine)
    raw, temperature_c = (grid.ravel() for grid in np.meshgrid(*fine, indexing="ij"))
    axes = len(part.axes)
    apart = np.zeros((axes, axes))
    for axis, by in np.ndindex(axes, axes):
        interpolated = _bilinear(table.errors[axis, by], table.outputs, table.temperatures_c, raw, temperature_c)
        apart[axis, by] = np.abs(interpolated - exact.errors[axis, by].ravel()).max()
    difference = apart.sum(axis=1)
    raw_all, warm_all = all_turning(part)
    together = np.abs(raw_all - table.error_dps(raw_all, warm_all) - part.rate(raw_all, warm_all)).max(axis=0)
    return float((difference + (together if axes > 1 else 0.0)).max())


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the table; raises BadInput for a model that depends on more than output and temperature."""
    needs_thermometer(
        calibration,
        NAME,
        "the error of this calibration is the same at every temperature; use format python, c or json",
    )
    part = static_part(calibration, NAME, carries="the table of this format depends on output and temperature only")
    m = whole_number(options, "outputs", (2, MOST), OUTPUTS, NAME) if part.has_rates else 1
    n = whole_number(options, "temperatures", (2, MOST), TEMPERATURES, NAME)
    table = table_of(part, part.outputs(m), part.temperatures(n))
    differs = largest_difference(part, table)
    losses = part.losses()
    head = head_lines(calibration, "the whole correction of output and temperature", differs, losses, [
        "Rate of an axis = its output - the sum over by_axis of error_dps, linear between output_dps of by_axis and",
        "between temperature_c; outside the table hold both at its edge. All rates in deg/s.",
    ])  # fmt: skip
    lines = [COLUMNS]
    for axis, by in np.ndindex(table.errors.shape[:2]):
        for i, j in np.ndindex(m, n):
            place = f"{table.outputs[i]:.12g},{table.temperatures_c[j]:.12g}"
            lines.append(f"{calibration.axes[axis]},{calibration.axes[by]},{place},{table.errors[axis, by, i, j]:.9g}")
    return Written((commented(head) + "\n".join(lines) + "\n").encode("ascii"), losses, differs)


def _refined(grid: Array) -> Array:
    n = len(grid)
    return np.interp(np.arange(REFINED * (n - 1) + 1) / REFINED, np.arange(n), grid)


def _bilinear(values: Array, outputs: Array, temperatures_c: Array, output: Array, temperature_c: Array) -> Array:
    """Return values (m, n) over outputs (m,) and temperatures (n,) at points (k,), held at the edges."""
    i, s = _place(outputs, output)
    j, t = _place(temperatures_c, temperature_c)
    i1, j1 = np.minimum(i + 1, len(outputs) - 1), np.minimum(j + 1, len(temperatures_c) - 1)
    low = values[i, j] * (1 - t) + values[i, j1] * t
    return np.asarray(low * (1 - s) + (values[i1, j] * (1 - t) + values[i1, j1] * t) * s)


def _place(grid: Array, at: Array) -> tuple[NDArray[np.int64], Array]:
    """Return the mesh that each point is in, and how far through it, 0 to 1."""
    if len(grid) == 1:
        return np.zeros(len(at), dtype=np.int64), np.zeros(len(at))
    held = np.clip(at, grid[0], grid[-1])
    index = np.clip(np.searchsorted(grid, held, side="right") - 1, 0, len(grid) - 2)
    return index, (held - grid[index]) / (grid[index + 1] - grid[index])


FORMAT = Format(
    "Table (CSV)",
    "text/csv; charset=us-ascii",
    "csv",
    write,
    {"outputs": f"number of outputs, 2 to {MOST}; default {OUTPUTS}",
     "temperatures": f"number of temperatures, 2 to {MOST}; default {TEMPERATURES}"},
)  # fmt: skip
