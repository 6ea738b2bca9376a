"""Calibrations: fit and versions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import NotRequired

from typing_extensions import TypedDict

from labctl.answers.calibrations import (
    CalibrationRow,
    FitRequest,
    FitResponse,
    Follower,
    ImprovedVersionResponse,
    VersionResponse,
)
from labctl.answers.fitted_model import TypePriorJson
from labctl.answers.kept_answers import KeptFit
from labctl.calibration import Calibration, build_calibration, read_calibration
from labctl.errors import BadInput
from labctl.fitting import FitResult, fit
from labctl.fitting.effects.response import IDS
from labctl.fitting.models.memory import split_memory
from labctl.fitting.uncertainty import AxisEvidence, evidence_of
from labctl.recording.info import REFERENCES, measured_at
from labctl.services.calibrations.certification import certification_response, version_in_force
from labctl.services.calibrations.comparison import worse_than_raw
from labctl.services.calibrations.next_version import answer_of, keep_next_version
from labctl.services.criticism.measurements import Measurements, measurements_of
from labctl.services.fixed_coefficients import fixed_of
from labctl.services.recordings.inspection import refuse_wrong
from labctl.services.recordings.warnings import as_json, warning_of
from labctl.services.standards.usage import Notices
from labctl.store import NewCalibration, RecordingRow, Store


def remembered_by(calibration: Calibration) -> list[Follower]:
    """Return the elements that follow the temperature in the use of a version; none of one without memory."""
    _, memory = split_memory(calibration.fitted, calibration.axes)
    return [
        Follower(
            kind=each.kind, parameter=each.parameter, unit="s" if each.kind == "lag" else "K",
            cooling_s=each.cooling_s, is_curved=each.part == "curved",
            reference_c=each.reference_c if each.part == "curved" else None,
            size=dict(zip(calibration.axes, each.size.tolist(), strict=True)),
            scale=None if each.scale is None else dict(zip(calibration.axes, each.scale.tolist(), strict=True)),
        )
        for each in (memory.followers if memory is not None else ())
    ]  # fmt: skip


@dataclass(frozen=True)
class FittedUnit:
    """A fit of a unit that is not kept yet, and the version that it becomes under a number."""

    build: Callable[[int], NewCalibration]
    result: FitResult
    rows: tuple[RecordingRow, ...]
    bench: str | None  #: that of the campaign of the newest recording; None: it was imported


def fit_unit(store: Store, serial: str, request: FitRequest, at: datetime, *, is_draft: bool = False) -> FitResponse:
    """Fit a model to a unit's recording and keep it as the next version.

    Raises NotFound, BadInput for an unknown model or effect and for coefficients that cannot be held, NotEnoughData,
    DataRefused for data that are certainly wrong and for a fit that is worse than none. A draft (`is_draft`) is kept
    once: raises Conflict for another one.
    """
    fitted = fitted_unit(store, serial, request, at, is_draft=is_draft)
    return FitResponse.model_validate(answer_of(keep_next_version(store, serial, at, fitted.build)), extra="forbid")


def fitted_unit(store: Store, serial: str, request: FitRequest, at: datetime, *, is_draft: bool = False) -> FittedUnit:
    """Fit a model to a unit's recording and keep nothing. Raises what `fit_unit` raises."""
    measured = measurements_of(store, serial, request.recording, request.recordings)
    recording, campaign, recordings = measured.row.id, measured.row.campaign, measured.recordings
    job_title = f"fit of {measured.named} of {serial}"
    refuse_wrong(measured.warnings, job_title, accepted=request.accept_warnings)
    source = measured.source
    result, evidence, of_type = _results(store, serial, request, measured)
    late = source.info.motion == "profile" and IDS.isdisjoint(result.fitted.model.effect_ids)
    warnings = [*measured.warnings, *map(warning_of, worse_than_raw(result.error, late=late))]
    refuse_wrong(warnings, job_title, accepted=request.accept_warnings)
    run = store.campaigns.get(campaign) if campaign is not None else None
    recipe, bench = (run.recipe_name, run.bench_name) if run is not None else (None, None)
    provenance = {
        "recording": recording, "campaign": campaign, "recipe": recipe, "bench": bench, **several(recordings),
        **reference_of(measured.rows), **of_type,
    }  # fmt: skip

    def build(version: int) -> NewCalibration:
        calibration = build_calibration(
            source.info, result, version=version, parent=None, issued_at=at, provenance=provenance, evidence=evidence,
            used_on=days_of(measured.rows),
        )  # fmt: skip
        answer: KeptFit = {
            "serial": serial, "version": version, **result.to_json(), "recording": recording,
            "recordings": list(recordings), "campaign": campaign, "recipe": recipe, "bench": bench,
            "hash": calibration.hash, "warnings": [as_json(warning) for warning in warnings], **of_type,
        }  # fmt: skip
        return NewCalibration(
            None, recording, result.fitted.model.name, calibration.to_bytes(), calibration.hash, answer, recordings,
            is_draft=is_draft,
        )  # fmt: skip

    return FittedUnit(build, result, measured.rows, bench)


class OfType(TypedDict):
    """What a version states of the other units of the type in its coefficients; empty: it was fitted alone."""

    type_prior: NotRequired[TypePriorJson]


def _results(
    store: Store, serial: str, request: FitRequest, measured: Measurements
) -> tuple[FitResult, Mapping[str, AxisEvidence], OfType]:
    """Fit a model to measurements, alone or with the prior of the unit's type."""
    source, fixed = measured.source, fixed_of(request.fixed)
    if not request.type_prior:
        result = fit(source, request.model, request.effects, covered=measured.covered, fixed=fixed)
        return result, evidence_of(source, request.model, request.effects, fixed), {}
    from labctl.fitting.fleet.prior import fit_recording_with_prior  # noqa: PLC0415  slow to load, and seldom needed
    from labctl.services.design.type_prior import prior_of_type  # noqa: PLC0415  as above

    if fixed is not None:
        raise BadInput(
            f"{serial}: coefficients are held at known values and a prior of the type is asked for; choose one"
        )
    unit = store.units.get(serial)
    known = prior_of_type(
        store, unit.model, request.model, request.effects, without=serial,
        groups={"batch": unit.batch, "supplier": unit.supplier}, on=measured_at(measured.rows[-1].info),
    )  # fmt: skip
    with_prior = fit_recording_with_prior(
        source, request.model, request.effects, known.prior, known.argument, covered=measured.covered
    )
    stated = known.to_json(is_used=with_prior.is_used, p_value=with_prior.p_value)
    return with_prior.result, with_prior.evidence, {"type_prior": stated}


def several(recordings: tuple[int, ...]) -> dict[str, list[int]]:
    """Return what a calibration's provenance says of its recordings beside the newest, where there are several."""
    return {"recordings": list(recordings)} if len(recordings) > 1 else {}


def reference_of(rows: Sequence[RecordingRow]) -> dict[str, str]:
    """Return what a calibration's provenance says of the rates of its recordings, where that is known."""
    infos = [row.recording_info for row in rows]
    references = dict.fromkeys(REFERENCES[info.rate_reference] for info in infos if info.rate_reference is not None)
    return {"rate_reference": "; ".join(references)} if references else {}


def days_of(rows: Sequence[RecordingRow]) -> list[date]:
    """Return the days on which recordings were begun; of one without a date that of its import, the latest possible."""
    return [row.recording_info.started_at.date() for row in rows]


def list_calibrations(store: Store, serial: str) -> list[CalibrationRow]:
    """Return a unit's versions, newest first. Raises NotFound."""
    in_force, notices = version_in_force(store, serial), Notices.of(store)
    return [
        CalibrationRow(
            serial=row.serial,
            version=row.version,
            parent=row.parent,
            model=row.model,
            created_at=row.created_at,
            hash=row.hash,
            certified=row.version == in_force,
            rms_dps=row.answer["error"]["rms_dps"],
            heldout_rms_dps=row.answer["error"]["heldout_rms_dps"],
            notices=notices.of_recordings(row.recordings),
        )
        for row in store.calibrations.of_unit(store.units.get(serial).serial)
    ]


def one_version(store: Store, serial: str, version: int) -> VersionResponse | ImprovedVersionResponse:
    """Return a version as it was made, and whether it is in force. Raises NotFound."""
    row = store.calibrations.get(store.units.get(serial).serial, version)
    history = store.calibrations.history(serial)
    in_force = bool(history) and history[0].act == "certify" and history[0].version == version
    calibration = read_calibration(row.document)
    last = next((certification_response(act) for act in history if act.version == version), None)
    beside = {
        "parent": row.parent, "recording": row.recording, "recordings": list(row.recordings),
        "created_at": row.created_at, "hash": row.hash,
        "rate_reference": calibration.document["provenance"].get("rate_reference", ""),
        "left_out": list(calibration.document["left_out"]), "remembers": remembered_by(calibration),
        "notices": Notices.of(store).of_recordings(row.recordings), "in_force": in_force,
        "due": last.due if last is not None and in_force else None, "certification": last,
    }  # fmt: skip
    kind = ImprovedVersionResponse if "improved_from" in row.answer else VersionResponse
    return kind.model_validate({**answer_of(row), **beside})
