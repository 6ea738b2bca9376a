"""A matrix K and a bias B at each temperature: output = K rate + B (Yang et al. 2018, eqs. 1 to 5)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import Axis
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
from labctl.fitting.models.temperature import Constant, LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.recording import OutputUnit, Recording

TERMS = (Term("bias"), Term("scale_factor"), Term("misalignment"))
#: Temperatures that yang2018 interpolates between, and the one that single_temperature takes, deg C.
POINTS, TRADITIONAL_C = 3, 25.0


def from_matrices(recording: Recording, model: str) -> FitResult:
    """Return yang2018, or single_temperature from the row nearest 25 deg C. Raises NotEnoughData for too few rows."""
    several = model == "yang2018"
    axes, given_c = recording.info.axes, numbers(recording, "temperature_c")
    order = rising(recording, given_c, ", ".join(axes), POINTS if several else 1)
    if not several:
        order = order[[int(np.argmin(np.abs(given_c[order] - TRADITIONAL_C)))]]
    nodes, valid_c = given_c[order], (float(given_c.min()), float(given_c.max()))
    fits: dict[str, AxisFit] = {axis: _axis(recording, axis, order) for axis in axes}
    table = LagrangeTable(tuple(nodes.tolist()), POINTS) if several else Constant()
    terms = TERMS if len(axes) > 1 else TERMS[:2]
    law = ErrorModel(model, terms, "rate", table, Reference(TRADITIONAL_C))
    raw: dict[str, Array] = {axis: fit.values[0] for axis, fit in fits.items()}
    return FitResult(FittedModel(law, fits), error_figures(raw, nodes), valid_c, rate_range_dps(recording))


def _axis(recording: Recording, axis: Axis, rows: NDArray[np.intp]) -> AxisFit:
    """Return the row of K and the element of B that belong to one output, without K's unit diagonal."""
    output = recording.info.output.get(axis, OutputUnit())
    other_axes = tuple(other for other in recording.info.axes if other != axis)
    columns = (f"b_{axis}", f"k_{axis}{axis}", *(f"k_{axis}{other}" for other in other_axes))
    values = np.array([numbers(recording, name)[rows] for name in columns])
    values[0] -= output.offset
    values /= output.scale
    values[1] -= 1.0
    u = np.array([uncertainty(recording, name)[rows] for name in columns]) / abs(output.scale)
    effects = ("bias", "scale_factor", *("misalignment" for _ in other_axes))
    names = ("bias", "scale_factor", *(f"misalignment_{other}" for other in other_axes))
    return axis_fit(effects, names, ("deg/s", *("1" for _ in columns[1:])), values, u)
