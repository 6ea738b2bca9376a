"""Scale factors and offsets against temperature, as the Gyrostar report prints them (Weiss 1995)."""

from __future__ import annotations

import numpy as np

from labctl.fitting.effects import Reference, Term
from labctl.fitting.estimation.published.common import (
    axis_fit,
    error_figures,
    numbers,
    rate_range_dps,
    rising,
    uncertainty,
)
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.recording import OutputUnit, Recording
from labctl.recording.info import Axis

TERMS = (Term("bias"), Term("scale_factor"))


def from_scale_offset(recording: Recording, model: str) -> FitResult:
    """Return the model with straight lines between the temperatures. Raises NotEnoughData below two of them."""
    axes: dict[str, AxisFit] = {}
    for axis in recording.info.axes:
        nodes, axes[axis] = _axis(recording, axis)
    law = ErrorModel(model, TERMS, "rate", LagrangeTable(tuple(nodes.tolist()), 2), Reference(25.0))
    raw = {axis: fit.values[0] for axis, fit in axes.items()}
    valid_c = (float(nodes[0]), float(nodes[-1]))
    return FitResult(FittedModel(law, axes), error_figures(raw, nodes), valid_c, rate_range_dps(recording))


def _axis(recording: Recording, axis: Axis) -> tuple[Array, AxisFit]:
    columns = recording.columns
    here = np.asarray(columns["axis"]) == axis if "axis" in columns else np.ones(len(recording), dtype=bool)
    order = rising(recording, numbers(recording, "temperature_c", here), axis, 2)
    rows = np.flatnonzero(here)[order]
    output = recording.info.output.get(axis, OutputUnit())
    values = np.array(
        [
            (numbers(recording, "offset")[rows] - output.offset) / output.scale,
            numbers(recording, "scale_factor")[rows] / output.scale - 1.0,
        ]
    )
    u = np.array([uncertainty(recording, name)[rows] / abs(output.scale) for name in ("offset", "scale_factor")])
    fit = axis_fit(("bias", "scale_factor"), ("bias", "scale_factor"), ("deg/s", "1"), values, u)
    return numbers(recording, "temperature_c")[rows], fit
