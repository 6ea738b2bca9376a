"""Criticism: a model held against a recording. What remains, where, what may be missing, and what cannot be tested."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from labctl.fitting.criticism.diagnostics import views_of
from labctl.fitting.criticism.model_comparison import Comparison, compare_models, with_noise_of
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.criticism.residuals import Residuals, residuals_of
from labctl.fitting.criticism.search.refinement import refined_term
from labctl.fitting.criticism.search.stepwise import search_stepwise
from labctl.fitting.criticism.suspects import Suspect, suspects_of
from labctl.fitting.criticism.verdict import Verdict
from labctl.fitting.criticism.visibility import not_testable
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.static_record import LONG_S, static_record
from labctl.fitting.data.temperature_channel import with_temperature
from labctl.fitting.effects import CATALOGUE, Effect, Term
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed, unchanged
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.progress import report_stage
from labctl.recording import Recording

#: Data sets beyond the base's coefficients that a verdict needs.
LEAST_SPARE = 6
#: From this factor on the drift counts as larger than the data sheet says.
LARGE_DRIFT = 2.0


@dataclass(frozen=True)
class Criticism:
    """Result of a criticism."""

    verdict: Verdict
    data: ReducedRecording
    base: FitResult | None  #: the model fitted in its forward form; None without `full`
    direct_rms_dps: float | None  #: of the law of the output as it is applied; None for a law of the true rate
    comparison: Comparison | None  #: None where there is too little for a verdict
    residuals: Mapping[str, Residuals] = field(default_factory=dict)
    suspects: tuple[Suspect, ...] = ()
    not_testable: tuple[Mapping[str, Any], ...] = ()
    explained: float | None = None
    views: Mapping[str, Any] = field(default_factory=dict)

    @property
    def drift_over_datasheet(self) -> float | None:
        """The largest drift found, over half the data sheet's bias stability; None without a data sheet."""
        stability = self.data.info.datasheet.get("bias_stability_dps")
        if not stability or not self.residuals:
            return None
        return float(np.max([r.drift_dps for r in self.residuals.values()]) / (stability / 2))


@single_threaded
def criticise(
    recording: Recording,
    model: ErrorModel,
    catalogue: Mapping[str, Effect] = CATALOGUE,
    *,
    points: Recording | None = None,
    full: bool = True,
) -> Criticism:
    """Hold a model against a recording. Without `full` only the verdict is sought, as long studies do.

    `points` are the recording's means, where they are already known. Raises NotEnoughData only where the model cannot
    even be fitted; too little for a verdict is a verdict. Raises Cancelled at a stage that finds it cancelled.
    """
    report_stage("reducing the recording")
    recording = with_temperature(recording)
    data = replace(reduce_recording(recording), static=static_record(recording, 0.0 if full else LONG_S))
    fit_data = fit_data_of(points or recording)
    report_stage("fitting the model")
    base = fit_preset(fit_data, changed(model)) if full else None
    forward, _ = changed(model).build(fit_data)
    if (short := _too_little(data, forward)) is not None:
        return Criticism(Verdict("insufficient_data", reason=short), data, base, None, None)
    comparison = compare_models(data, forward, catalogue)
    verdict, initial, final = search_stepwise(comparison, catalogue)
    if base is None:
        return Criticism(verdict, data, None, None, comparison)
    report_stage("listing suspects and residuals")
    seen = comparison if final is comparison else with_noise_of(comparison, final)
    residuals = residuals_of(seen)
    suspects = tuple(suspects_of(comparison, seen, fit_data, forward, refined_term))
    suspected = {*verdict.named, *(s.candidate.id for s in suspects if s.candidate.log_bf > 0)}
    return Criticism(
        verdict, data, base, _direct_rms_dps(fit_data, model), comparison, residuals,
        suspects, tuple(line for line in not_testable(comparison, catalogue) if line["effect"] not in suspected),
        _explained(initial),
        views_of(seen, residuals, recording, catalogue),
    )  # fmt: skip


@single_threaded
def best_shapes(
    recording: Recording, model: ErrorModel, catalogue: Mapping[str, Effect], *, points: Recording
) -> dict[str, Term]:
    """Return effect id -> the shape that fits a recording best beside a model, whatever the evidence for the effect.

    `points` are the recording's means. Raises NotEnoughData where the model cannot be fitted.
    """
    recording = with_temperature(recording)
    data = replace(reduce_recording(recording), static=static_record(recording))
    forward, _ = changed(model).build(fit_data_of(points))
    comparison = compare_models(data, forward, catalogue)
    return {c.id: refined_term(comparison, c) for c in comparison.candidates if not c.smooth and c.term is not None}


@single_threaded
def residuals_beside_missing(found: Criticism, catalogue: Mapping[str, Effect] = CATALOGUE) -> dict[str, Residuals]:
    """Return the residuals of a criticism with the noise that remains beside all that it found missing.

    Empty where there was too little for a verdict.
    """
    comparison = found.comparison
    if comparison is None:
        return {}
    if found.verdict.terms:
        missing = tuple(replace(term, steady=True) for term in found.verdict.terms.values())
        fuller = comparison.model.with_terms((*comparison.model.terms, *missing))
        comparison = with_noise_of(comparison, compare_models(found.data, fuller, catalogue))
    return residuals_of(comparison)


def _direct_rms_dps(data: FitData, model: ErrorModel) -> float | None:
    """Return the error of a law of the output as it is applied, deg/s; None for a law of the true rate."""
    return fit_preset(data, unchanged(model)).error.rms_dps if model.argument == "output" else None


def _too_little(data: ReducedRecording, model: ErrorModel) -> str | None:
    """Return what is missing for a verdict, in words, or None."""
    axis = data.info.axes[0]
    columns = sum(1 for _, c in model.columns(data.nodes, axis) if np.any(c.values))
    needed = columns * (len(getattr(model.temperature, "nodes_c", ())) or 1) + LEAST_SPARE
    rows = int(data.present.sum())
    if len(data) < needed and rows < 4 * needed:
        return (
            f"{len(data)} data sets, and the model has {needed - LEAST_SPARE} coefficients per axis: "
            f"measure at least {needed - len(data)} more data sets, at other rates and temperatures"
        )
    return None


def _explained(first: Comparison) -> float:
    """Return the share of the raw excess chi2 that the base explains, 0 to 1."""
    excess = raw = 0.0
    for axis, found in first.axes.items():
        freedom = found.rows - found.base_columns
        excess += max(found.best.chi2 - freedom, 0.0)
        data = first.data
        raw += float(np.sum(data.error_dps(axis)[0] ** 2 / (first.white_var[axis] + found.best.noise.size_dps**2)))
    return float(np.clip(1.0 - excess / max(raw, 1e-12), 0.0, 1.0))
