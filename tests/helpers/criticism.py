"""A preset model compared with a recording."""

from __future__ import annotations

from typing import Any

from labctl.answers.criticism import CriticisedErrors, CriticisedNoise, CriticismResponse, LackOfFit
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


def bare_criticism(**more: Any) -> CriticismResponse:
    """Return a criticism without a verdict, with the fields that are given."""
    given = {
        "serial": "S</script>", "version": 1, "recording": 1, "verdict": "insufficient_data",
        "text": ["Too little <data>."], "where": [], "named": [], "depends_on": [], "suspects": [], "experiments": [],
        "not_testable": [], "noise": dict.fromkeys(CriticisedNoise.__annotations__),
        "lack_of_fit": dict.fromkeys(LackOfFit.__annotations__),
        "error": dict.fromkeys(CriticisedErrors.__annotations__) | {"noise_floor_source": "none"},
    }  # fmt: skip
    return CriticismResponse.model_validate(given | more)
