"""From a recording of kind "coefficients" to a fit result, by the form of its table."""

from __future__ import annotations

from collections.abc import Callable

from labctl.errors import BadInput
from labctl.fitting.estimation.published.matrices import from_matrices
from labctl.fitting.estimation.published.polynomials import from_polynomials
from labctl.fitting.estimation.published.scale_offset import from_scale_offset
from labctl.fitting.estimation.published.surface import from_surface
from labctl.fitting.estimation.result import FitResult
from labctl.recording import Recording
from labctl.recording.coefficient_forms import MATRIX, POLYNOMIALS, SCALE_OFFSET, SURFACE, form_of

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
