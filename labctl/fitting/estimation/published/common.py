"""What all published tables have in common: uncertainties, nodes, ranges and error figures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.estimation.error_metrics import ErrorFigures, rms
from labctl.fitting.models.fitted_model import AxisFit
from labctl.fitting.models.temperature import lagrange_weights
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording, RecordingInfo

#: Largest rate of a unit whose recording does not state it, deg/s.
USUAL_MAX_RATE_DPS = 90.0

Rows = NDArray[np.bool_] | slice


def numbers(recording: Recording, name: str, rows: Rows = slice(None)) -> Array:
    """Return a column of a table as floats, (n,)."""
    return np.asarray(recording.columns[name], dtype=np.float64)[rows]


def uncertainty(recording: Recording, name: str, rows: Rows = slice(None)) -> Array:
    """Return the standard uncertainty of a column, (n,); 0 where the table states none."""
    u_column = f"u_{name}"
    if u_column in recording.columns:
        return numbers(recording, u_column, rows)
    return np.zeros(len(numbers(recording, name, rows)))


def axis_fit(
    effects: tuple[str, ...], names: tuple[str, ...], units: tuple[str, ...], values: Array, u: Array
) -> AxisFit:
    """Return the coefficients of an axis, values and u (k, m), taken as independent of each other.

    A covariance of zeros stands for a table that states no uncertainty; `AxisFit.u` is NaN then.
    """
    return AxisFit(effects, names, units, values, np.diag(u.ravel() ** 2))


def rate_range_dps(recording: Recording) -> tuple[float, float]:
    """Return the lowest and the highest rate that a table is valid at, deg/s."""
    return full_range_dps(recording.info)


def full_range_dps(info: RecordingInfo) -> tuple[float, float]:
    """Return the lowest and the highest rate of a unit, deg/s; the usual ones where its recording does not say it."""
    full = info.max_rate_dps or USUAL_MAX_RATE_DPS
    return -full, full


def rising(recording: Recording, nodes: Array, axis: str, least: int) -> NDArray[np.intp]:
    """Return the order in which temperatures rise. Raises NotEnoughData for too few, or one that is repeated."""
    order = np.argsort(nodes)
    if len(nodes) < least or np.any(np.diff(nodes[order]) <= 0):
        raise NotEnoughData(
            f"{recording.info.serial}, axis {axis}: a table needs at least {least} different temperature"
            f"{'' if least == 1 else 's'} and only one row for each; it has {len(nodes)} rows at "
            f"{len(np.unique(nodes))} temperatures; correct column temperature_c"
        )
    return order


def error_figures(raw: Mapping[str, Array], nodes: Array) -> ErrorFigures:
    """Return the error figures of a table whose nominal conversion is off by `raw`, axis -> (m,) deg/s, at rest."""
    held = {axis: _from_neighbours(nodes, bias) for axis, bias in raw.items()}
    return ErrorFigures(rms(raw), 0.0, rms(held), None, "none")


def _from_neighbours(nodes: Array, bias: Array) -> Array:
    """Return what each inner node's neighbours predict for it, minus what the table says, (m - 2,)."""
    if len(nodes) < 3:
        return np.zeros(0)
    pairs = np.column_stack([nodes[:-2], nodes[2:]])
    weights = lagrange_weights(pairs, nodes[1:-1])
    return weights[:, 0] * bias[:-2] + weights[:, 1] * bias[2:] - bias[1:-1]


def row_of(recording: Recording, axis: str) -> int:
    """Return the row of an axis in a table with one row per axis. Raises NotEnoughData for none or several."""
    columns = recording.columns
    rows = np.flatnonzero(np.asarray(columns["axis"]) == axis) if "axis" in columns else np.arange(len(recording))
    if len(rows) != 1:
        raise NotEnoughData(
            f"{recording.info.serial}, axis {axis}: a polynomial needs exactly one row for each axis, found "
            f"{len(rows)}; correct the column `axis` of the file"
        )
    return int(rows[0])


def common(recording: Recording, name: str, rows: list[int]) -> float:
    """Return the value of a column that all axes share. Raises NotEnoughData where they differ."""
    values: Array = numbers(recording, name)[rows]
    if np.any(values != values[0]):
        listed = ", ".join(f"{value:g}" for value in values)
        raise NotEnoughData(
            f"{recording.info.serial}: column {name!r} differs between the axes ({listed}); give the same "
            "values for all axes"
        )
    return float(values[0])
