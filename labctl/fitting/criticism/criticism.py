"""Criticism: a model compared with a recording. What remains, where, what may be missing, and what cannot be tested."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import attrgetter

import numpy as np
from scipy.special import chdtrc

from labctl.answers.criticism import Advice, NotTestable, SlowProcess
from labctl.answers.views import Views
from labctl.fitting.criticism import residual_limits
from labctl.fitting.criticism.advice import advice_for, is_carried
from labctl.fitting.criticism.candidates import beside_held
from labctl.fitting.criticism.diagnostics import views_of
from labctl.fitting.criticism.model_comparison import Comparison, compare_models, with_noise_of
from labctl.fitting.criticism.output_lattice import steps_of
from labctl.fitting.criticism.reduction import ReducedRecording, reduce_recording
from labctl.fitting.criticism.residuals import Residuals, residuals_of
from labctl.fitting.criticism.rivals import FAR
from labctl.fitting.criticism.search.refinement import refined_term
from labctl.fitting.criticism.search.stepwise import search_stepwise
from labctl.fitting.criticism.slow_process import slow_process, with_hypothesis, without_harm
from labctl.fitting.criticism.suspects import (
    MIN_CAUSE,
    Suspect,
    is_only_shape,
    suspects_of,
    with_groups,
    without_shapes,
)
from labctl.fitting.criticism.thermal_family import LAG, ThermalFamily, family_or_hint, with_family
from labctl.fitting.criticism.verdict import Verdict
from labctl.fitting.criticism.visibility import not_testable
from labctl.fitting.data.fit_data import FitData, fit_data_of
from labctl.fitting.data.mounting_angles import leaning_rates
from labctl.fitting.data.noise_floor import NoiseFloor
from labctl.fitting.data.static_record import LONG_S, StaticRecord, static_record
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.fitting.effects import CATALOGUE, Effect, Term, kind_of
from labctl.fitting.effects.response import response_of_terms
from labctl.fitting.estimation.axis_solutions import solve_axes
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.result import FitResult
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed, unchanged
from labctl.fitting.numeric.blas_threads import single_threaded
from labctl.fitting.numeric.drift_noise import Drift
from labctl.progress import report_stage
from labctl.recording import Recording
from labctl.recording.verification import fitted_part

#: A residual up to this many times what the steps leave in a mean (or of another axis its noise) is theirs.
STEPS_LEAVE = 1.5
QUANTIZATION = "quantization"
NO_CORRECTION = Advice(
    effect=QUANTIZATION, add=False, checked=True, why="no calibration corrects what the steps of an output leave out",
    before_dps=None, after_dps=None,
)  # fmt: skip


def with_quantization(verdict: Verdict, data: ReducedRecording, left: Mapping[str, Residuals]) -> Verdict:
    """Return the verdict, or quantization in place of another cause where no axis leaves more than its steps do.

    The catalogue's effect of that name is a law of raw codes, and competes where these are logged.
    """
    if verdict.form not in {"unexplained", "missing", "ambiguous"} or not data.steps or not left:
        return verdict
    for axis, residuals in left.items():
        step = data.steps.get(axis)
        most = STEPS_LEAVE * (step["left_dps"] if step else float(np.sqrt(np.mean(residuals.floor_dps**2))))
        if float(np.sqrt(np.mean(residuals.means**2))) > most:
            return verdict
    return Verdict("missing", ((QUANTIZATION,),), axes={QUANTIZATION: tuple(data.steps)})


#: Data sets beyond the base's coefficients that a verdict needs.
MIN_SPARE = 6
#: The drift counts as larger than the data sheet says where the least that it may be is this many times as large.
LARGE_DRIFT = 1.5
#: From this chance on that noise leaves as much as a residual, the residual may be noise.
BY_CHANCE = 0.05


@dataclass(frozen=True)
class Criticism:
    """Result of a criticism."""

    verdict: Verdict
    data: ReducedRecording
    fit_data: FitData  #: the means of the same recording, as a fit sees them
    base: FitResult | None  #: the model fitted in its forward form; None without `full`
    direct_rms_dps: float | None  #: of the law of the output as it is applied; None for a law of the true rate
    comparison: Comparison | None  #: None where there is too little for a verdict
    fuller: Comparison | None = None  #: beside all that was found missing
    suspects: tuple[Suspect, ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    advice: tuple[Advice, ...] = ()  #: for the leading effect of each group
    slow: SlowProcess | None = None  #: of a record at rest
    explained: float | None = None
    views: Views = field(default_factory=Views)
    family: ThermalFamily | None = None  #: the thermal response that the verdict names
    hint: ThermalFamily | None = None  #: one that predicts, but not enough to be named

    @property
    def floor(self) -> NoiseFloor:
        """The noise of the recording, whatever the model: the same as that of a fit to it."""
        return self.fit_data.noise_floor

    @property
    def next_effect(self) -> str | None:
        """The effect to add next, of those named: one whose addition is advised, else one that was fitted."""
        named = self.verdict.named
        advised = [each["effect"] for each in self.advice if each["add"]]
        fitted = [suspect.candidate.id for suspect in self.suspects if suspect.after is not None]
        return next((effect for effect in (*advised, *fitted, *named) if effect in named), None)

    @cached_property
    def beside_missing(self) -> Comparison | None:
        """The comparison with the noise that remains beside all that was found missing."""
        if self.comparison is None or self.fuller is None or self.fuller is self.comparison:
            return self.comparison
        return with_noise_of(self.comparison, self.fuller)

    @cached_property
    def residuals(self) -> Mapping[str, Residuals]:
        """What the model leaves, by axis; nothing where there was too little for a verdict."""
        if self.beside_missing is None:
            return {}
        return residuals_of(self.beside_missing, self.floor, self.base.residual_dps if self.base is not None else None)

    @property
    def lack_of_fit(self) -> tuple[float | None, float | None]:
        """Chi2 of the whitened residual over its degrees of freedom, and the chance that noise leaves as much."""
        if not self.residuals:
            return None, None
        chi2 = sum(left.chi2 for left in self.residuals.values())
        freedom = max(sum(left.freedom for left in self.residuals.values()), 1)
        return float(chi2 / freedom), float(chdtrc(freedom, chi2))

    @property
    def drift_over_datasheet(self) -> float | None:
        """The largest drift found, over half the data sheet's bias stability; None where one of both is not known."""
        return self._over_datasheet(attrgetter("drift_dps"))

    @property
    def has_large_drift(self) -> bool:
        """Whether nearly all evidence is for a drift that is larger than the data sheet says."""
        return (self._over_datasheet(attrgetter("least_dps")) or 0.0) >= LARGE_DRIFT

    def _over_datasheet(self, size_dps: Callable[[Drift], float]) -> float | None:
        stability = self.data.info.stability_dps
        if not stability or self.comparison is None:
            return None
        if not all(noise.is_drift_found for noise in self.floor.axes.values()):  # the data sheet over itself
            return None
        return max(size_dps(noise.drift) for noise in self.floor.axes.values()) / (stability / 2)


@dataclass(frozen=True)
class FittedMeans:
    """The means of a recording, and the model fitted to them."""

    data: FitData
    base: FitResult


@single_threaded
def fit_means(points: Recording, model: ErrorModel) -> FittedMeans:
    """Fit a model to the means of a recording. Raises NotEnoughData, NotConverged."""
    report_stage("fitting the model")
    data = fit_data_of(points)
    return FittedMeans(data, fit_preset(data, changed(model)))


@single_threaded
def criticise(
    recording: Recording, model: ErrorModel, catalogue: Mapping[str, Effect] = CATALOGUE, *,
    points: Recording | None = None, fitted: FittedMeans | None = None, full: bool = True, is_decimated: bool = False,
    static: StaticRecord | None = None,
) -> Criticism:  # fmt: skip
    """Compare a model with a recording. Without `full` only the verdict is computed, for long studies.

    `points` are the recording's means, and `fitted` the fit to them, where they are already known. Averages do not show
    the noise of readings: where the readings are averages (`is_decimated`), `static` is the static record by all, or
    None. Raises NotEnoughData only where the model cannot even be fitted; too little for a verdict is a verdict. Raises
    Cancelled at a stage that finds it cancelled.
    """
    if fitted is None and full:
        fitted = fit_means(points or recording, model)
    fit_data = fitted.data if fitted is not None else fit_data_of(points or recording)
    base = fitted.base if fitted is not None else None
    report_stage("reducing the recording")
    recording = with_temperature(fitted_part(recording))
    data = _reduced(recording, static, is_decimated=is_decimated, full=full)
    forward = _forward(fit_data, model, base)
    if (short := _too_little(data, forward)) is not None:
        return Criticism(Verdict("insufficient_data", reason=short), data, fit_data, base, None, None)
    data = _leaning(data, fit_data, forward)
    seen = data.through(response_of_terms(forward.terms))
    comparison = compare_models(beside_held(seen, forward), forward, catalogue)
    verdict, initial, final = search_stepwise(comparison, catalogue)
    verdict = residual_limits.applied(verdict, initial, fit_data, forward, base)
    family, hint = family_or_hint(fit_data, forward, verdict)
    verdict = with_family(verdict, family)
    named = Criticism(verdict, data, fit_data, base, None, comparison, final, family=family, hint=hint)
    criticism = _checked(named, forward, full=full)
    if not full or criticism.beside_missing is None:
        return criticism
    report_stage("listing suspects and residuals")
    suspects = suspects_of(comparison, criticism.beside_missing, fit_data, forward, base, criticism.verdict.named)
    verdict, suspects = _without_weak_names(criticism, suspects, forward), without_shapes(suspects, forward)
    suspects = with_groups(suspects, verdict.groups)
    suspected = {*verdict.named, *(s.candidate.id for s in suspects if s.candidate.log_bf > 0)}
    return replace(
        criticism,
        verdict=verdict,
        advice=tuple(each for each in criticism.advice if each["effect"] in verdict.named),
        family=_with_time_constants(criticism.family, fit_data, forward),
        hint=_with_time_constants(criticism.hint, fit_data, forward),
        direct_rms_dps=_direct_rms_dps(fit_data, model),
        suspects=suspects,
        not_testable=tuple(line for line in not_testable(comparison, catalogue) if line["effect"] not in suspected),
        explained=_explained(initial, seen),
        views=views_of(criticism.beside_missing, criticism.residuals, recording, catalogue),
    )


@single_threaded
def best_shapes(
    recording: Recording, model: ErrorModel, catalogue: Mapping[str, Effect], *, points: Recording,
    is_decimated: bool = False, static: StaticRecord | None = None,
) -> dict[str, Term]:  # fmt: skip
    """Return effect id -> the shape that fits a recording best beside a model, whatever the evidence for the effect.

    `points` are the recording's means, `is_decimated` and `static` as of `criticise`. Raises NotEnoughData where the
    model cannot be fitted.
    """
    recording = with_temperature(fitted_part(recording))
    data = replace(reduce_recording(recording), static=static if is_decimated else static_record(recording))
    fit_data = fit_data_of(points)
    forward = _forward(fit_data, model, None)
    seen = _leaning(data, fit_data, forward).through(response_of_terms(forward.terms))
    comparison = compare_models(beside_held(seen, forward), forward, catalogue)
    return {c.id: refined_term(comparison, c) for c in comparison.candidates if not c.smooth and c.term is not None}


def _checked(criticism: Criticism, forward: ErrorModel, *, full: bool) -> Criticism:
    """Return a criticism with advice on what it names, and at rest without names that this refutes."""
    comparison, verdict = criticism.comparison, criticism.verdict
    if comparison is None:
        return criticism
    verdict = with_quantization(verdict, criticism.data, criticism.residuals)
    slow = slow_process(comparison, criticism.residuals)
    family = criticism.family
    members = () if family is None else family.terms
    others = [group for group in verdict.groups if group[0] not in {term.effect for term in members}]
    leaders = [term for group in others if (term := _to_check(comparison, verdict, group)) is not None]
    advice = advice_for(criticism.fit_data, forward, leaders, members) if full or slow is not None else ()
    advice = advice if family is None else (family.advice, *advice)
    verdict = with_hypothesis(without_harm(verdict, advice, slow, comparison), comparison, slow)
    advice = (*advice, NO_CORRECTION) if verdict.named == (QUANTIZATION,) else advice
    # two members were tried as one response, by stretches left out: the second is not the wrong shape of the first
    advice = advice if family is None else (*advice, *family.advice_beside)
    kept = tuple(each for each in advice if each["effect"] in verdict.named)
    return replace(criticism, verdict=verdict, advice=kept, slow=slow, family=family if LAG in verdict.named else None)


def _reduced(recording: Recording, static: StaticRecord | None, *, is_decimated: bool, full: bool) -> ReducedRecording:
    """Return a recording reduced to means, with its record at rest and the steps of its outputs."""
    data = reduce_recording(recording)
    if not is_decimated:
        static = static_record(recording, 0.0 if full else LONG_S)
    return replace(data, static=static, steps=steps_of(recording, data.white_var))


def _to_check(comparison: Comparison, verdict: Verdict, group: tuple[str, ...]) -> Term | None:
    """Return the effect of a group that could be added: the first that a calibration carries, else the leader."""
    known = {c.id: c for c in comparison.candidates if not c.smooth and c.term is not None}
    leader = verdict.terms.get(group[0])
    if leader is None or is_carried(leader):
        return leader
    others = (refined_term(comparison, known[name]) for name in group[1:] if name in known)
    return next((term for term in others if is_carried(term)), leader)


def _with_time_constants(
    family: ThermalFamily | None, data: FitData, forward: ErrorModel
) -> ThermalFamily | None:  # fmt: skip
    """Return the family with the uncertainties of its time constants, as the model with it has them."""
    if family is None:
        return None
    after = fit_preset(data, changed(forward, family.terms))
    return family.with_shapes(after.shapes)


def _without_weak_names(criticism: Criticism, suspects: Sequence[Suspect], forward: ErrorModel) -> Verdict:
    """Return the verdict, or "adequate" where noise may leave the residual, and what is named is no cause of it.

    That is weak evidence for effects that hardly lower the error, although it is above the noise floor. Another shape
    of an effect that the model has is not named beside other effects.
    """
    verdict = criticism.verdict
    if verdict.form not in {"missing", "ambiguous"}:
        return verdict
    listed = {each.candidate.id for each in suspects}  # a shape that fits worse is not
    shapes = {each.candidate.id for each in suspects if is_only_shape(each, forward)}
    shapes |= set(verdict.named) & set(forward.effect_ids) - listed
    groups = tuple(
        group for names in verdict.groups if (group := tuple(name for name in names if name not in shapes) or names)
    )
    named = [each for each in suspects if each.candidate.id in verdict.named]
    weak = all(each.candidate.log_bf < FAR and each.share_removed < MIN_CAUSE for each in named)
    weak = weak and set(verdict.named) <= listed | shapes
    error = criticism.base.error if criticism.base is not None else None
    above = error is not None and (error.rms_dps or 0.0) > (error.noise_floor_dps or np.inf)
    if named and weak and above and (criticism.lack_of_fit[1] or 0.0) >= BY_CHANCE:
        further = tuple(group for group in groups if not set(group) <= shapes)
        return Verdict("adequate", further=further)
    return replace(verdict, groups=groups)  # what was ambiguous stays so: fewer names are no more certain


def _forward(data: FitData, model: ErrorModel, base: FitResult | None) -> ErrorModel:
    """Return the model in its forward form, a delay and a bandwidth as they are fitted to these data sets."""
    forward, _ = changed(model).build(data)
    if data.channels.profile is None or not any(kind_of(term).exact for term in forward.terms):
        return forward
    fitted = base or fit_preset(data, changed(model))
    return forward.with_terms(fitted.fitted.model.terms)


def _leaning(data: ReducedRecording, fit_data: FitData, forward: ErrorModel) -> ReducedRecording:
    """Return the recording with the true rates of a unit that leans as its mountings do, where they separate that.

    What is left of the angles stays free in the base; so small, only its first order matters.
    """
    if not any(len(fit_data.angle_columns(axis)) for axis in fit_data.outputs):
        return data
    angles = {axis: fitted.angles_rad for axis, fitted in solve_axes(fit_data, forward).nuisance.items()}
    return replace(data, nodes=data.nodes.with_rates(leaning_rates(data.nodes, angles)))


def _direct_rms_dps(data: FitData, model: ErrorModel) -> float | None:
    """Return the error of a law of the output as it is applied, deg/s; None for a law of the true rate."""
    return fit_preset(data, unchanged(model)).error.rms_dps if model.argument == "output" else None


def _too_little(data: ReducedRecording, model: ErrorModel) -> str | None:
    """Return what is missing for a verdict, in words, or None."""
    axis = data.info.axes[0]
    columns = sum(1 for _, c in model.columns(data.nodes, axis) if np.any(c.values))
    needed = columns * (len(getattr(model.temperature, "nodes_c", ())) or 1) + MIN_SPARE
    rows = int(data.present.sum())
    if len(data) < needed and rows < 4 * needed:
        return (
            f"{len(data)} data sets are too few for a model of {needed - MIN_SPARE} coefficients per axis: measure "
            f"at least {needed - len(data)} more data sets, at other rates and temperatures"
        )
    return None


def _explained(first: Comparison, data: ReducedRecording) -> float:
    """Return the share of the excess chi2 of the raw `data` that the base explains, 0 to 1."""
    excess = raw = 0.0
    for axis, compared in first.axes.items():
        freedom = compared.rows - compared.base_columns
        excess += max(compared.best.chi2 - freedom, 0.0)
        raw += float(np.sum(data.error_dps(axis)[0] ** 2 / (first.white_var[axis] + compared.best.noise.size_dps**2)))
    return float(np.clip(1.0 - excess / max(raw, 1e-12), 0.0, 1.0))
