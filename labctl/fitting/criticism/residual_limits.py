"""What a residual far above the noise floor, or far evidence, changes in the verdict that a search has found."""

from __future__ import annotations

from dataclasses import replace

from labctl.errors import LabctlError
from labctl.fitting.criticism.level_dependence import levels_behind
from labctl.fitting.criticism.model_comparison import Comparison
from labctl.fitting.criticism.rivals import FAR
from labctl.fitting.criticism.verdict import Verdict
from labctl.fitting.data.fit_data import FitData
from labctl.fitting.data.noise_floor import BY_REPEATS
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed

#: No model is adequate that leaves more than this many times the noise floor, whatever the evidence for any one cause.
MAX_OVER_FLOOR = 3.0
#: Effects are not named that leave this share of what is above the floor, and this many floors, where it is known.
LEAVES_MOST, FAR_ABOVE = 0.5, 2.0


def applied(verdict: Verdict, initial: Comparison, data: FitData, model: ErrorModel, base: FitResult | None) -> Verdict:
    """Return a verdict as the noise floor allows it. `base` is the fit of the model, None where it was not made."""
    verdict = _without_large_residual(_beyond_noise(verdict, initial), base)
    return verdict if base is None else _without_small_causes(verdict, data, model, base)


def _beyond_noise(verdict: Verdict, initial: Comparison) -> Verdict:
    """Return the verdict, or "unexplained" in place of an adequate model beside far evidence for what is not physical.

    The evidence says that more than noise is left; that the size of the nearest effect is impossible says that the
    effect is not its cause, and not that there is none.
    """
    if verdict.form != "adequate":
        return verdict
    doubtful = [c for c in initial.candidates if not c.smooth and not c.physical and c.log_bf >= FAR]
    if not doubtful:
        return verdict
    return replace(verdict, form="unexplained", further=(), not_physical=tuple(c.id for c in doubtful))


def _without_large_residual(verdict: Verdict, base: FitResult | None) -> Verdict:
    """Return the verdict, or "unexplained" in place of an adequate model whose residual is far above the floor."""
    if verdict.form != "adequate" or base is None:
        return verdict
    left, floor = base.error.rms_dps, base.error.noise_floor_dps
    if left is None or not floor or left <= MAX_OVER_FLOOR * floor:
        return verdict
    return replace(verdict, form="unexplained", further=())


def _without_small_causes(verdict: Verdict, data: FitData, model: ErrorModel, base: FitResult) -> Verdict:
    """Return the verdict, or "unexplained" in place of names that together leave most of the residual, far above noise.

    Asked where data sets that repeat each other show the noise and there are no readings: a comparison then takes for
    noise what a flexible model leaves, and so also what no effect of the catalogue explains.
    """
    floor_dps, before_dps = data.noise_floor.rms_dps, base.error.rms_dps
    if not verdict.groups or data.noise_floor.source != BY_REPEATS or not floor_dps or before_dps is None:
        return verdict
    terms = tuple(verdict.terms[group[0]] for group in verdict.groups if group[0] in verdict.terms)
    try:
        left_dps = fit_preset(data, changed(model, terms)).error.rms_dps
    except (
        LabctlError
    ):  # it is not determined beside the model, or cannot be inverted: that is reported of each suspect
        return verdict
    if left_dps is None or left_dps < FAR_ABOVE * floor_dps:
        return verdict
    if left_dps**2 - floor_dps**2 < LEAVES_MOST * (before_dps**2 - floor_dps**2):
        return verdict
    channels = levels_behind(data, base.residual_dps) or verdict.depends_on
    return Verdict("unexplained", (), channels, confounded=verdict.confounded)
