"""A model held against a recording: what is left, where, what may be missing, and what this recording cannot say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.special import chdtrc

from labctl.errors import LabctlError
from labctl.fitting.criticism.candidates import untestable_channels
from labctl.fitting.criticism.diagnostics import views_of
from labctl.fitting.criticism.evidence import visible_share
from labctl.fitting.criticism.model_comparison import Candidate, Comparison, compare_models, with_noise_of
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.criticism.refine import refined
from labctl.fitting.criticism.residuals import Residuals, maps, residuals_of, where_it_fails, worst_data_sets
from labctl.fitting.criticism.stepwise_search import search_stepwise
from labctl.fitting.criticism.verdict import (
    ENOUGH,
    Verdict,
    alias_group,
    coefficients_of,
    probabilities,
    share_removed,
)
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.static_record import LONG_S, static_record
from labctl.fitting.data.temperature_channel import with_temperature
from labctl.fitting.effects import CATALOGUE, Effect
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.recording import Recording

#: Data sets beyond the base's coefficients that a verdict needs.
LEAST_SPARE = 6
#: Less of an effect than this beside the base, and the schedule cannot see it.
LEAST_VISIBLE = 0.15
#: How many suspects are fitted in full.
SHOWN = 6
#: The drift is larger than the data sheet says from this factor on.
LARGE_DRIFT = 2.0


@dataclass(frozen=True)
class Suspect:
    """An effect that may be missing."""

    candidate: Candidate
    probability: float
    p_value: float
    coefficients: Mapping[str, Any]
    share_removed: float
    after: FitResult | None
    group: tuple[str, ...]


@dataclass(frozen=True)
class Criticism:
    """The whole answer."""

    verdict: Verdict
    data: ReducedRecording
    base: FitResult | None
    direct_rms_dps: float | None
    weighed: Comparison | None
    residuals: Mapping[str, Residuals] = field(default_factory=dict)
    suspects: tuple[Suspect, ...] = ()
    not_testable: tuple[Mapping[str, Any], ...] = ()
    explained: float | None = None
    views: Mapping[str, Any] = field(default_factory=dict)

    @property
    def drift_over_datasheet(self) -> float | None:
        """The drift found, over half the data sheet's bias stability; None without a data sheet."""
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
    shape_only: bool = False,
) -> Criticism:
    """Hold a model against a recording. Without `full` only the verdict is sought, as long studies do.

    `points` are the recording's means, where they are already known; `shape_only` seeks the best shape of each effect
    of the catalogue, whatever speaks for it.

    Raises NotEnoughData only where the model cannot even be fitted; too little for a verdict is a verdict.
    """
    recording = with_temperature(recording)
    data = replace(reduce_recording(recording), static=static_record(recording, 0.0 if full else LONG_S))
    context = fit_data_of(points or recording)
    if shape_only:
        return Criticism(_shapes(data, changed(model).build(context)[0], catalogue), data, None, None, None)
    base = fit_preset(context, changed(model)) if full else None
    forward, _ = changed(model).build(context)
    if (short := _too_little(data, forward)) is not None:
        return Criticism(Verdict("insufficient_data", reason=short), data, base, None, None)
    weighed = compare_models(data, forward, catalogue)
    verdict, begun, last = search_stepwise(weighed, catalogue)
    if not full:
        return Criticism(verdict, data, None, None, weighed)
    assert base is not None
    seen = weighed if last is weighed else with_noise_of(weighed, last)
    left = residuals_of(seen)
    direct = fit_preset(context, _direct(model)).error.rms_dps if model.argument == "output" else None
    suspects = tuple(_suspects(weighed, seen, context, forward, verdict))
    spoken_for = {*verdict.named, *(s.candidate.id for s in suspects if s.candidate.log_bf > 0)}
    return Criticism(
        verdict, data, base, direct, weighed, left,
        suspects, tuple(line for line in _not_testable(weighed, catalogue) if line["effect"] not in spoken_for),
        _explained(begun),
        views_of(seen, left, recording, catalogue),
    )  # fmt: skip


def _shapes(data: ReducedRecording, model: ErrorModel, catalogue: Mapping[str, Effect]) -> Verdict:
    weighed = compare_models(data, model, catalogue)
    terms = {c.id: refined(weighed, c) for c in weighed.candidates if not c.smooth and c.term is not None}
    return Verdict("adequate", terms=terms)


def _direct(model: ErrorModel) -> Any:
    from labctl.fitting.models.presets import Preset  # noqa: PLC0415

    return Preset(model.name, lambda context: (model, np.ones(len(context), dtype=bool)))


def _too_little(data: ReducedRecording, model: ErrorModel) -> str | None:
    """Say what is missing for a verdict, or None."""
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
    """Return which share of the raw excess the base explains, 0 to 1."""
    excess = raw = 0.0
    for axis, found in first.axes.items():
        freedom = found.rows - found.base_columns
        excess += max(found.best.chi2 - freedom, 0.0)
        data = first.data
        y = data.output[axis] - data.rows_of(data.nodes.rate_dps(axis)[:, None])[:, :, 0]
        raw += float(np.sum(y[0] ** 2 / (first.white_var[axis] + found.best.noise.size_dps**2)))
    return float(np.clip(1.0 - excess / max(raw, 1e-12), 0.0, 1.0))


def _suspects(
    weighed: Comparison, seen: Comparison, context: FitData, model: ErrorModel, verdict: Verdict
) -> list[Suspect]:
    """Return what may be missing, best first: ranked as weighed, with sizes as `seen` with the noise that remains."""
    chance = probabilities(weighed.candidates)
    effects = [c for c in weighed.candidates if not c.smooth][:SHOWN]
    found = []
    for candidate in effects:
        dimensions = sum(int(seen.axes[a].dimensions[o]) for a, o in candidate.option.items())
        gain = sum(float(seen.axes[a].gain[o]) for a, o in candidate.option.items())
        tried = sum(len(d.options) for d in weighed.designs.values()) / max(len(weighed.designs), 1)
        single = float(chdtrc(max(dimensions, 1), gain))
        after = None
        if candidate.log_bf >= 0 and candidate.term is not None:
            term = verdict.terms.get(candidate.id, candidate.term)
            try:
                after = fit_preset(context, changed(model, (term,)))
            except LabctlError:  # it cannot be fitted beside the base, or not be inverted: there is no figure
                after = None
        group = alias_group(weighed, candidate) if candidate.log_bf >= ENOUGH else (candidate.id,)
        found.append(
            Suspect(
                candidate,
                chance[candidate.id],
                float(-np.expm1(tried * np.log1p(-min(single, 1 - 1e-16)))),
                coefficients_of(seen, candidate),
                share_removed(seen, candidate),
                after,
                group,
            )
        )
    return found


def _not_testable(weighed: Comparison, catalogue: Mapping[str, Effect]) -> list[Mapping[str, Any]]:
    """Return what this recording cannot say anything about: a channel is missing, or the schedule hides it."""
    absent = untestable_channels(weighed.data, catalogue)
    found: list[Mapping[str, Any]] = [
        {"effect": effect_id, "why": "channel", "needs": needs} for effect_id, needs in absent.items()
    ]
    shares = visible_shares(weighed)
    for kind in catalogue.values():
        if kind.id in absent or kind.id in weighed.model.effect_ids or kind.id == "rate_temperature_surface":
            continue
        if shares.get(kind.id, 0.0) < LEAST_VISIBLE:
            found.append({"effect": kind.id, "why": "schedule", "needs": [], "visible": shares.get(kind.id, 0.0)})
    return found


def visible_shares(weighed: Comparison) -> dict[str, float]:
    """Return how much of each effect this schedule lets be seen beside the base, 0 to 1, in its most visible shape."""
    shares: dict[str, float] = {}
    for axis, design in weighed.designs.items():
        found = weighed.axes[axis]
        for option, where in zip(design.options, found.slices, strict=True):
            if not option.smooth:
                share = visible_share(found.best, where)
                shares[option.candidate] = max(shares.get(option.candidate, 0.0), share)
    return shares


def worst(criticism: Criticism) -> list[dict[str, Any]]:
    """Return the data sets furthest from the model."""
    return worst_data_sets(criticism.data, criticism.residuals)


def failing(criticism: Criticism) -> list[dict[str, Any]]:
    """Return where the residual is far from 0."""
    return where_it_fails(criticism.data, criticism.residuals)


def pictures(criticism: Criticism) -> list[dict[str, Any]]:
    """Return the maps of residual over floor."""
    return maps(criticism.data, criticism.residuals)
