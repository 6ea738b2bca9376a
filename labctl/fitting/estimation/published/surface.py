"""The error as a polynomial in output and temperature: matrix C of Ojeda et al. 2000, eqs. 9 to 13.

Coefficients by power, never by position: the paper prints descending powers. The output is in deg/s after the nominal
conversion, the temperature in K above `reference_c`; a paper that takes plain deg C has `reference_c` = 0.
"""

from __future__ import annotations

import numpy as np

from labctl.fitting.effects import Reference, Term
from labctl.fitting.effects.scale_factor import surface_unit
from labctl.fitting.estimation.error_metrics import ErrorFigures, rms
from labctl.fitting.estimation.published.common import axis_fit, common, numbers, rate_range_dps, row_of, uncertainty
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.fitted_model import AxisFit, FittedModel
from labctl.fitting.numeric.arrays import Array
from labctl.recording import Recording
from labctl.recording.coefficient_forms import TEMPERATURE_POWER, form_of

EFFECT = "rate_temperature_surface"
#: Temperatures over the stated range at which the raw error at rest is evaluated.
SHOWN = 11


def from_surface(recording: Recording, model: str) -> FitResult:
    """Return the direct law, corrected rate = output - error(output, temperature), one row per axis.

    Raises NotEnoughData where an axis has no row of its own, or the rows differ in reference or range.
    """
    axes = recording.info.axes
    rows = [row_of(recording, axis) for axis in axes]
    reference_c, low_c, high_c = (
        common(recording, name, rows) for name in ("reference_c", "temperature_low_c", "temperature_high_c")
    )
    cells = form_of(recording.columns).coefficients(recording.info, recording.columns)
    fits: dict[str, AxisFit] = {axis: _axis(recording, cells, row) for axis, row in zip(axes, rows, strict=True)}
    order = len(cells) // (TEMPERATURE_POWER + 1) - 1
    law = ErrorModel(model, (Term(EFFECT, order),), "output", reference=Reference(reference_c))
    centred = np.linspace(low_c, high_c, SHOWN) - reference_c
    at_rest = centred[:, None] ** np.arange(TEMPERATURE_POWER + 1)
    raw: dict[str, Array] = {axis: at_rest @ fit.values[: TEMPERATURE_POWER + 1, 0] for axis, fit in fits.items()}
    error = ErrorFigures(rms(raw), 0.0, None, None, "none")
    return FitResult(FittedModel(law, fits), error, (low_c, high_c), rate_range_dps(recording))


def _axis(recording: Recording, cells: list[str], row: int) -> AxisFit:
    values = np.array([[numbers(recording, name)[row]] for name in cells])
    u = np.array([[uncertainty(recording, name)[row]] for name in cells])
    units = tuple(surface_unit(int(name[3]), int(name[6])) for name in cells)
    return axis_fit((EFFECT,) * len(cells), tuple(cells), units, values, u)
