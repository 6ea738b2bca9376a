"""Calibrations from published tables of coefficients, as the Gyrostar report prints them (Weiss 1995)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.errors import NotEnoughData
from labctl.fitting.effects import Reference, Term
from labctl.fitting.estimation.error_metrics import ErrorFigures, rms
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.temperature import LagrangeTable, lagrange_weights
from labctl.fitting.numeric.arrays import Array
from labctl.recording import OutputUnit, Recording

TERMS = (Term("bias"), Term("scale_factor"))
DEFAULT_MAX_RATE_DPS = 90.0


def from_coefficients(recording: Recording) -> FitResult:
    """Make weiss1995 from a table of scale factors and offsets against temperature.

    Straight lines between the temperatures. The errors are those of the nominal conversion at rest, one value per
    temperature; held out, an inner temperature is predicted from its neighbours. A table carries no uncertainty, so
    the covariance is zero and there is no noise floor.
    """
    axes: dict[str, AxisFit] = {}
    raw: dict[str, Array] = {}
    held: dict[str, Array] = {}
    for axis in recording.info.axes:
        nodes, scale, offset = _rows_of(recording, axis)
        output = recording.info.output.get(axis, OutputUnit())
        bias, gain = (offset - output.offset) / output.scale, scale / output.scale - 1.0
        axes[axis] = AxisFit(
            ("bias", "scale_factor"),
            ("bias", "scale_factor"),
            ("deg/s", "1"),
            np.array([bias, gain]),
            np.zeros((2 * len(nodes), 2 * len(nodes))),
        )
        raw[axis] = bias
        held[axis] = _left_out(nodes, bias)
    model = ErrorModel("weiss1995", TERMS, "rate", LagrangeTable(tuple(nodes.tolist()), 2), Reference(25.0))
    full = recording.info.max_rate_dps or DEFAULT_MAX_RATE_DPS
    error = ErrorFigures(rms(raw), 0.0, rms(held), None, "none")
    return FitResult(FittedModel(model, axes), error, (float(nodes[0]), float(nodes[-1])), (-full, full))


def _rows_of(recording: Recording, axis: str) -> tuple[Array, Array, Array]:
    columns: dict[str, NDArray[np.generic]] = dict(recording.columns)
    rows = columns["axis"] == axis if "axis" in columns else np.ones(len(recording), dtype=bool)
    order = np.argsort(columns["temperature_c"][rows])
    nodes, scale, offset = (
        np.asarray(columns[name], dtype=np.float64)[rows][order] for name in ("temperature_c", "scale_factor", "offset")
    )
    if len(nodes) < 2 or np.any(np.diff(nodes) <= 0):
        raise NotEnoughData(
            f"{recording.info.serial}, axis {axis}: a table needs at least two different temperatures, each once; "
            f"it has {len(nodes)} rows at {len(np.unique(nodes))} temperatures, correct column temperature_c"
        )
    return nodes, scale, offset


def _left_out(nodes: Array, bias: Array) -> Array:
    """Return what each inner node's neighbours predict for it, minus what the table says, (m - 2,)."""
    pairs = np.column_stack([nodes[:-2], nodes[2:]])
    weights = lagrange_weights(pairs, nodes[1:-1])
    return weights[:, 0] * bias[:-2] + weights[:, 1] * bias[2:] - bias[1:-1]
