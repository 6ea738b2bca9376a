"""Bias, and perhaps scale factor, as polynomials in temperature: one row per axis, no readings."""

from __future__ import annotations

import numpy as np

from labctl.answers.recording_head import Axis
from labctl.fitting.effects import Reference, Term
from labctl.fitting.estimation.error_metrics import ErrorFigures, rms
from labctl.fitting.estimation.published.common import axis_fit, common, numbers, rate_range_dps, row_of, uncertainty
from labctl.fitting.estimation.published.surface import SHOWN
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.recording import OutputUnit, Recording
from labctl.recording.coefficient_forms import form_of

#: Letter of a column -> effect and coefficient, and its unit; higher powers of temperature are an effect of their own.
EFFECTS = {"b": ("bias", "deg/s"), "k": ("scale_factor", "1")}


def from_polynomials(recording: Recording, model: str) -> FitResult:
    """Return the forward law, output = rate + bias + scale factor error x rate, each a polynomial in temperature.

    Raises NotEnoughData where an axis has no row of its own, or the rows differ in reference or range.
    """
    axes = recording.info.axes
    cells = form_of(recording.columns).coefficients(recording.info, recording.columns)
    rows = [row_of(recording, axis) for axis in axes]
    reference_c, low_c, high_c = (
        common(recording, name, rows) if name in recording.columns else None
        for name in ("reference_c", "temperature_low_c", "temperature_high_c")
    )
    fits: dict[str, AxisFit] = {axis: _axis(recording, axis, cells, row) for axis, row in zip(axes, rows, strict=True)}
    law = ErrorModel(model, _terms(cells), "rate", reference=Reference(reference_c or 0.0))
    centred = (
        np.zeros(1) if low_c is None or high_c is None else np.linspace(low_c, high_c, SHOWN) - (reference_c or 0.0)
    )
    biases = sum(cell.startswith("b") for cell in cells)
    at_rest = centred[:, None] ** np.arange(biases)
    raw: dict[str, Array] = {axis: at_rest @ fit.values[:biases, 0] for axis, fit in fits.items()}
    error = ErrorFigures(rms(raw), 0.0, None, None, "none")
    return FitResult(FittedModel(law, fits), error, (low_c, high_c), rate_range_dps(recording))


def _terms(cells: list[str]) -> tuple[Term, ...]:
    """Return the effects that columns such as b_t0, b_t1, k_t0 need."""
    polynomial_terms = []
    for letter, (effect, _) in EFFECTS.items():
        highest = max((int(cell[-1]) for cell in cells if cell[0] == letter), default=-1)
        polynomial_terms += [Term(effect)] if highest >= 0 else []
        polynomial_terms += [Term(f"{effect}_temperature", highest)] if highest > 0 else []
    return tuple(polynomial_terms)


def _axis(recording: Recording, axis: Axis, cells: list[str], row: int) -> AxisFit:
    output = recording.info.output.get(axis, OutputUnit())
    values = np.array([[numbers(recording, name)[row]] for name in cells])
    values[cells.index("b_t0")] -= output.offset
    values /= output.scale
    if "k_t0" in cells:
        values[cells.index("k_t0")] -= 1.0
    u = np.array([[uncertainty(recording, name)[row]] for name in cells]) / abs(output.scale)
    powers = [int(name[-1]) for name in cells]
    named = [EFFECTS[name[0]] for name in cells]
    effects = tuple(f"{e}_temperature" if p else e for (e, _), p in zip(named, powers, strict=True))
    names = tuple(f"{e}_t{p}" if p else e for (e, _), p in zip(named, powers, strict=True))
    units = tuple(unit + ("", "/K", "/K^2")[p] for (_, unit), p in zip(named, powers, strict=True))
    return axis_fit(effects, names, units, values, u)
