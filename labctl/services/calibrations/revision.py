"""A version's model changed: effects added or taken out, fitted again; previewed, or kept as the next version."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from labctl.answers.calibrations import ImproveRequest, ImproveResponse, PreviewResponse
from labctl.answers.fitted_model import UsualRange
from labctl.answers.inspection import DataWarning
from labctl.answers.kept_answers import ChangeFigures, KeptChange
from labctl.answers.residuals import ResidualColumns
from labctl.calibration import build_calibration
from labctl.errors import BadInput
from labctl.fitting import FitResult
from labctl.fitting.criticism import ThermalFamily, best_shapes, criticise, hint_of_added
from labctl.fitting.data.fit_data import fit_data_of
from labctl.fitting.effects import CATALOGUE, Term, kind_of, parse_term, read_formulas
from labctl.fitting.estimation.fit import fit_preset
from labctl.fitting.estimation.shapes import with_shapes
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.presets import changed
from labctl.fitting.uncertainty import use_evidence
from labctl.recording import Recording
from labctl.services.cache import RecentResults, cached
from labctl.services.calibrations.comparison import worse_than_before
from labctl.services.calibrations.fitting import days_of, reference_of, several
from labctl.services.calibrations.next_version import answer_of, keep_next_version, refuse_taken
from labctl.services.criticism.evaluation import model_of
from labctl.services.criticism.measurements import Measurements, measurements_of
from labctl.services.criticism.residuals import residual_columns
from labctl.services.criticism.versions import version_of
from labctl.services.recordings.inspection import refuse_wrong
from labctl.services.recordings.warnings import as_json, warning_of
from labctl.store import CalibrationRecord, NewCalibration, Store


@dataclass(frozen=True)
class _Change:
    """A changed model beside the one that it was made from, both fitted in the forward form."""

    row: CalibrationRecord
    measured: Measurements
    before: FitResult
    after: FitResult
    hint: ThermalFamily | None = None  #: of an added lag that is not certain

    @property
    def points(self) -> Recording:
        """The means that it was fitted to."""
        return self.measured.points

    @property
    def warnings(self) -> list[DataWarning]:
        """What is wrong with the data, and with the change."""
        return [*self.measured.warnings, *map(warning_of, worse_than_before(self.before.error, self.after.error))]

    @property
    def figures(self) -> ChangeFigures:
        """What is said of the change, whether it is kept or not."""
        technology = self.points.info.technology or ""
        return {
            **self.after.to_json(), "recording": self.measured.row.id,
            "recordings": list(self.measured.recordings), "improved_from": self.row.version,
            "before": self.before.error.to_dict(), "plausible": plausible(self.after, technology),
            "warnings": [as_json(warning) for warning in self.warnings],
            "thermal_hint": None if self.hint is None else self.hint.hint_json(),
        }  # fmt: skip


#: Changes that were fitted a moment ago: a preview is often kept as the next version.
_RECENT: RecentResults[_Change] = RecentResults(most=4)


def improve_unit(store: Store, serial: str, request: ImproveRequest, at: datetime) -> ImproveResponse:
    """Change a version's effects, fit again, keep it as the next.

    Raises NotFound, BadInput, NotEnoughData, DataRefused for data that are certainly wrong and for a result that is
    worse than no correction, VersionTaken where the number that the request expects is taken.
    """
    refuse_taken(store, store.units.get(serial).serial, request.as_version)
    change = _change(store, serial, request)
    job_title = f"change of version {change.row.version} of {serial} on {change.measured.named}"
    refuse_wrong(change.warnings, job_title, accepted=request.accept_warnings)
    return _keep(store, serial, change, at, request.as_version)


def preview_unit(store: Store, serial: str, request: ImproveRequest) -> PreviewResponse:
    """Return what `improve_unit` would make, and the residuals it would leave; nothing is changed.

    Raises NotFound, BadInput, NotEnoughData.
    """
    row = version_of(store, serial, request.version)
    measured = _asked(store, serial, request, row)

    def work() -> PreviewResponse:
        change = _change(store, serial, request)
        _, left_out = change.after.exported()
        preview = {"serial": serial, **change.figures, "left_out": left_out, "residuals": _residuals(change)}
        return PreviewResponse.model_validate(preview, extra="forbid")

    return cached(PreviewResponse, _question(row, measured, request), work)


def _asked(store: Store, serial: str, request: ImproveRequest, row: CalibrationRecord) -> Measurements:
    """Return the recordings that a change is fitted to: those asked for, those of a joint version, or the newest.

    One that was asked for by number is what it is fitted to, whatever the version was fitted to.
    """
    numbers: Sequence[int] = request.recordings
    if request.recording is None and not numbers and len(row.recordings) > 1:
        numbers = row.recordings
    return measurements_of(store, serial, request.recording, numbers)


def _question(row: CalibrationRecord, measured: Measurements, request: ImproveRequest) -> dict[str, object]:
    """Return all that a change depends on."""
    return {
        "serial": row.serial, "version": row.version, "hash": row.hash, **measured.question(),
        "change": request.model_dump(include={"add", "remove", "formula"}),
    }  # fmt: skip


def _residuals(change: _Change) -> ResidualColumns:
    """Return what a criticism of the changed model would leave, without all else that it says."""
    model = change.after.fitted.model
    residuals = replace(
        criticise(change.measured.readings, model, CATALOGUE, points=change.points, full=False), base=change.after
    )
    return residual_columns(residuals.data, residuals.residuals, change.points, change.measured.row.id, change.after)


def _change(store: Store, serial: str, request: ImproveRequest) -> _Change:
    """Fit a changed model, or return the fit of a moment ago."""
    row = version_of(store, serial, request.version)
    measured = _asked(store, serial, request, row)
    question_json = json.dumps(_question(row, measured, request), sort_keys=True)
    return _RECENT.get(question_json, lambda: _fitted(row, measured, request))


def _refuse_what_changes_nothing(
    wanted: Sequence[Term], model: ErrorModel, request: ImproveRequest, version: int
) -> None:
    """Raise BadInput for an effect that is there already.

    One with a shape may be added again: it gets another. One of which coefficients are held may: they are then fitted.
    """
    fixed = {term.effect for term in model.terms if not term.parameters} - model.held.effects
    for term in wanted:
        if term.effect in request.remove:
            raise BadInput(f"effect {term.effect!r} is both added and removed; give one of the two")
        if term.effect in fixed and term == Term(term.effect):
            raise BadInput(
                f"effect {term.effect!r} is in version {version} already; add another effect (the version has "
                f"{', '.join(model.effect_ids)})"
            )


def _fitted(row: CalibrationRecord, measured: Measurements, request: ImproveRequest) -> _Change:
    model = model_of(row)
    context = fit_data_of(measured.points, measured.covered)
    for effect_id in request.remove:
        if effect_id not in model.effect_ids:
            raise BadInput(
                f"effect {effect_id!r} is not in version {row.version}; choose one of {', '.join(model.effect_ids)}"
            )
    written = read_formulas(request.formula)
    terms = [*_terms(request.add), *(Term(f.id, formula=f.text) for f in written)]
    if not terms and not request.remove:
        raise BadInput("give the change: --add EFFECT, --remove EFFECT or --formula 'name: expression'")
    _refuse_what_changes_nothing(terms, model, request, row.version)
    base, _ = changed(model, (), tuple(request.remove)).build(context)
    add = tuple(_shaped(measured, base, term) for term in terms)
    is_open = bool(terms) and not any(term.parameters for term in terms)
    before = fit_preset(context, changed(model))
    after = fit_preset(context, with_shapes(context, changed(model, add, tuple(request.remove)), all_of_them=is_open))
    hint = hint_of_added(context, base, [term.effect for term in add])
    return _Change(row, measured, before, after, None if hint is None else hint.with_shapes(after.shapes))


def _terms(texts: Sequence[str]) -> list[Term]:
    """Return the effects to add. Raises BadInput for one that is unknown or given twice."""
    terms = [parse_term(text) for text in texts]
    counts = Counter(term.effect for term in terms)
    repeated = next((effect for effect, count in counts.items() if count > 1), None)
    if repeated is not None:
        raise BadInput(f"effect {repeated!r} is given {counts[repeated]} times in one change; give each effect once")
    return terms


def _shaped(measured: Measurements, base: ErrorModel, term: Term) -> Term:
    """Return a term with the order and the nonlinear parameters that fit the recording best, or that it states."""
    kind = kind_of(term)
    if term.parameters:
        return replace(term, steady=True)
    if term.order is not None or not (kind.parameters or kind.max_order):
        return term
    shape = best_shapes(
        measured.readings, base, {kind.id: kind}, points=measured.points, is_decimated=measured.is_decimated,
        static=measured.static,
    ).get(kind.id)  # fmt: skip
    return replace(shape, steady=True) if shape is not None else term


def _keep(store: Store, serial: str, change: _Change, at: datetime, expected: int | None) -> ImproveResponse:
    parent, after = change.row.version, change.after
    recording, recordings = change.measured.row.id, change.measured.recordings
    provenance = {
        "recording": recording, "improved_from": parent, **several(recordings), **reference_of(change.measured.rows),
    }  # fmt: skip
    evidence = use_evidence(fit_data_of(change.points), changed(after.fitted.model))

    def build(version: int) -> NewCalibration:
        calibration = build_calibration(
            change.points.info, after, version=version, parent=parent, issued_at=at, provenance=provenance,
            evidence=evidence,
            used_on=days_of(change.measured.rows),
        )  # fmt: skip
        answer: KeptChange = {
            "serial": serial, "version": version, "parent": parent, **change.figures,
            "left_out": list(calibration.document["left_out"]), "hash": calibration.hash,
        }  # fmt: skip
        return NewCalibration(
            parent, recording, after.fitted.model.name, calibration.to_bytes(), calibration.hash, answer, recordings
        )

    kept = keep_next_version(store, serial, at, build, expected)
    return ImproveResponse.model_validate(answer_of(kept), extra="forbid")


def plausible(result: FitResult, technology: str) -> dict[str, UsualRange]:
    """Return effect -> the range its first coefficient usually lies in, and whether it may do so on every axis.

    A range is one of sizes; of an effect that has only one sign, the sign counts too.
    """
    usual_ranges: dict[str, UsualRange] = {}
    for term in result.fitted.model.terms:
        kind = kind_of(term)
        span = kind.ranges.get(technology)
        if span is None:
            continue
        outside = False
        for fit in result.fitted.axes.values():
            if term.effect in fit.effects:
                first = fit.effects.index(term.effect)
                sizes = zip(fit.values[first], fit.u[first], strict=True)
                outside |= any(bool(kind.outside(technology, float(value), float(u))) for value, u in sizes)
        usual_ranges[term.effect] = {"from": span[0], "to": span[1], "inside": not outside}
    return usual_ranges
