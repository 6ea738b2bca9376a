"""From a recording of kind "coefficients" to a fit result, by the form of its table."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from labctl.answers.recording_head import Axis
from labctl.errors import BadInput
from labctl.fitting.effects import Reference, Term
from labctl.fitting.estimation.published.common import (
    axis_fit,
    error_figures,
    numbers,
    rate_range_dps,
    rising,
    uncertainty,
)
from labctl.fitting.estimation.published.matrices import from_matrices
from labctl.fitting.estimation.published.polynomials import from_polynomials
from labctl.fitting.estimation.published.surface import from_surface
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.models.temperature import LagrangeTable
from labctl.fitting.numeric.arrays import Array
from labctl.recording import OutputUnit, Recording
from labctl.recording.coefficient_forms import MATRIX, POLYNOMIALS, SCALE_OFFSET, SURFACE, form_of

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
    of_axis = np.asarray(columns["axis"]) == axis if "axis" in columns else np.ones(len(recording), dtype=bool)
    order = rising(recording, numbers(recording, "temperature_c", of_axis), axis, 2)
    rows = np.flatnonzero(of_axis)[order]
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


_MAKERS: dict[str, Callable[[Recording, str], FitResult]] = {
    SCALE_OFFSET: from_scale_offset,
    MATRIX: from_matrices,
    SURFACE: from_surface,
    POLYNOMIALS: from_polynomials,
}


def models_of(recording: Recording) -> tuple[str, ...]:
    """Return the names of the models that a table of coefficients makes, the one to propose first."""
    form = form_of(recording.columns)
    if form.name == POLYNOMIALS:
        cells = set(form.coefficients(recording.info, recording.columns))
        return ("bias_scale",) if "k_t0" in cells else ("bias",) if cells == {"b_t0"} else ("bias_temperature",)
    several = len(recording) >= 3  # what yang2018 interpolates between
    return form.models if several or form.name != MATRIX else tuple(reversed(form.models))


def from_coefficients(recording: Recording, model: str | None, effects: list[str]) -> FitResult:
    """Return the calibration that a published table states.

    The raw error is that of the nominal conversion at rest, one value per temperature; nothing is left of it, since the
    table is taken as it is. Held out, an inner temperature is predicted from its neighbours.

    Raises BadInput for another model than the table's, NotEnoughData for too few temperatures.
    """
    form, models = form_of(recording.columns), models_of(recording)
    if effects or model not in models:
        raise BadInput(
            f"{recording.info.serial}: the recording is a table of coefficients ({form.name}); fit it with --model "
            f"{' or --model '.join(models)}, without further effects"
        )
    return _MAKERS[form.name](recording, model)
