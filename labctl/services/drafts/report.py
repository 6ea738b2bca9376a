"""The report on a draft: its errors, the models beside it, the verdict, as found and as left, drift and limits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

from labctl.answers.certification import AssessmentResponse, CertifiedErrors
from labctl.answers.drafts import AppliedDraft, ComparedModel, DraftReport, DriftFromVersion, LimitResult
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting import fit
from labctl.fitting.estimation.error_metrics import first_of_smallest
from labctl.fitting.models.inversion import NotConverged
from labctl.progress import report_stage
from labctl.services.calibrations.assessment import assess
from labctl.services.calibrations.certification import version_in_force
from labctl.services.criticism.measurements import Measurements
from labctl.services.drafts.as_found import REFUSALS, applied, drift_from
from labctl.services.drafts.text import report_text
from labctl.store import CalibrationRecord, Store
from procedures.recipe.fit_rules import FitLimits, FitRules

Limit = Literal["heldout_rms_dps", "max_error_dps", "drift_dps"]


def held_against(
    limits: FitLimits, error: CertifiedErrors, as_left: AppliedDraft | None, drift: DriftFromVersion | None
) -> list[LimitResult]:
    """Return each limit with the figure that it is for; a figure that is not known decides nothing."""
    return list(_results(limits, error, as_left, drift))


def _results(
    limits: FitLimits, error: CertifiedErrors, as_left: AppliedDraft | None, drift: DriftFromVersion | None
) -> Iterator[LimitResult]:
    if (most := limits.heldout_rms_dps) is not None:
        reason = "" if error.heldout_rms_dps is not None else "no temperature could be left out of the fit"
        yield _result("heldout_rms_dps", None, error.heldout_rms_dps, most, reason)
    if (most := limits.max_error_dps) is not None:
        results = None if as_left is None else {axis: one.max_dps for axis, one in as_left.axes.items()}
        yield from _by_axis("max_error_dps", results, most, "the draft cannot be applied to the recording")
    if (most := limits.drift_dps) is not None:
        largest = None if drift is None else drift.largest_dps
        yield from _by_axis("drift_dps", largest, most, "no version was in force, or it cannot be applied")


def _by_axis(limit: Limit, largest_by_axis: dict[str, float] | None, most: float, why: str) -> Iterator[LimitResult]:
    if not largest_by_axis:
        yield _result(limit, None, None, most, why)
        return
    for axis, value in largest_by_axis.items():
        yield _result(limit, axis, value, most, "")


def _result(limit: Limit, axis: str | None, value: float | None, most: float, why: str) -> LimitResult:
    passed = None if value is None else value <= most
    return LimitResult(limit=limit, axis=axis, value_dps=value, at_most_dps=most, passed=passed, why=why)


def all_within(results: Sequence[LimitResult]) -> bool | None:
    """Return whether all limits are kept; None where there are none, or where none is broken but not all are known."""
    passed = [result.passed for result in results]
    if False in passed:
        return False
    return True if passed and None not in passed else None


NOT_ASKED = "the recipe does not request this comparison"


def report_on(store: Store, draft: CalibrationRecord, recording: int, rules: FitRules) -> DraftReport:
    """Return the report on a draft that was fitted to a recording as a recipe's [fit] says. Raises NotFound."""
    measured = Measurements(store, (store.recordings.get(recording),))
    error = CertifiedErrors.model_validate(dict(draft.answer["error"]))
    compared = [ComparedModel(model=draft.model, error=error), *_compared(measured, rules)]
    assessment = _assessed(store, draft, rules)
    as_left, as_left_why = applied(store, draft, measured)
    as_found, as_found_why, drift = _as_found(store, draft, measured, rules)
    limits = held_against(rules.limits, error, as_left, drift)
    report = DraftReport(
        model=draft.model, error=error, compared=compared, smallest_heldout=_smallest_heldout(compared, measured),
        verdict=assessment.verdict if assessment else None, verdict_text=assessment.verdict_text if assessment else "",
        verdict_reason=assessment.verdict_reason if assessment else NOT_ASKED,
        objections=assessment.objections if assessment else [],
        as_found=as_found, as_found_why=as_found_why, as_left=as_left, as_left_why=as_left_why, drift=drift,
        limits=limits, within_limits=all_within(limits), text="",
    )  # fmt: skip
    return report.model_copy(update={"text": report_text(draft.serial, draft.version, report)})


def _assessed(store: Store, draft: CalibrationRecord, rules: FitRules) -> AssessmentResponse | None:
    if not rules.criticise:
        return None
    report_stage("criticising the draft")
    return assess(store, draft.serial, draft.version)


def _compared(measured: Measurements, rules: FitRules) -> list[ComparedModel]:
    models: list[ComparedModel] = []
    for model in rules.compare:
        report_stage(f"fitting {model}")
        try:
            error = fit(measured.source, model, [], covered=measured.covered).error
        except (BadInput, NotEnoughData, NotConverged) as refusal:
            models.append(ComparedModel(model=model, error=None, why=str(refusal)))
            continue
        figures = {name: getattr(error, name) for name in CertifiedErrors.model_fields}
        models.append(ComparedModel(model=model, error=CertifiedErrors.model_validate(figures)))
    return models


def _smallest_heldout(compared: list[ComparedModel], measured: Measurements) -> str | None:
    errors = [
        (each.error.heldout_rms_dps, each.model)
        for each in compared
        if each.error is not None and each.error.heldout_rms_dps is not None
    ]
    if not errors:
        return None
    n = len(measured.points) * len(measured.points.info.axes)
    return errors[first_of_smallest([error for error, _ in errors], n)][1]


def _as_found(
    store: Store, draft: CalibrationRecord, measured: Measurements, rules: FitRules
) -> tuple[AppliedDraft | None, str, DriftFromVersion | None]:
    """Return the version in force applied to the recording, why it or the drift is missing, and the drift from it."""
    if not rules.against:
        return None, NOT_ASKED, None
    version = version_in_force(store, draft.serial)
    if version is None or version == draft.version:
        return None, "no version was in force", None
    report_stage(f"applying version {version}")
    in_force = store.calibrations.get(draft.serial, version)
    verification, reason = applied(store, in_force, measured)
    try:
        return verification, reason, drift_from(in_force, draft, measured)
    except REFUSALS as error:
        return verification, reason or str(error), None
