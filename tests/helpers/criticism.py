"""A preset model compared with a recording."""

from __future__ import annotations

from typing import Any

from labctl.fitting.criticism import Criticism, criticise
from labctl.fitting.criticism.diagnostics import views_of
from labctl.fitting.criticism.model_comparison import compare_models
from labctl.fitting.criticism.reduction import reduce_recording
from labctl.fitting.criticism.residuals import residuals_of
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE
from labctl.fitting.models.presets import changed, preset_for
from labctl.recording import Recording


def held(recording: Recording, model: str = "ojeda2000", catalogue: Any = CATALOGUE, full: bool = False) -> Criticism:
    """Return the criticism of a preset model, refitted to the recording."""
    fitted, _ = preset_for(model, []).build(fit_data_of(recording))
    return criticise(recording, fitted, catalogue, full=full)


def views(recording: Recording, model: str | None = "ojeda2000", effects: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return the views alone: nothing competes but one effect."""
    context = fit_data_of(recording)
    fitted, _ = preset_for(model, list(effects)).build(context)
    forward, _ = changed(fitted).build(context)
    comparison = compare_models(reduce_recording(recording), forward, {"bias_drift": CATALOGUE["bias_drift"]})
    return views_of(comparison, residuals_of(comparison, context.noise_floor), recording, CATALOGUE)
