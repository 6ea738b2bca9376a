"""Evaluation of a calibration version against a recording: what a criticism computes when no kept answer exists.

A module of its own, because a kept answer needs none of it, and these libraries take longer to load than that answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from labctl.answers.criticism import CriticismResponse, Experiment
from labctl.answers.laws import LawTest, ProposedLaw
from labctl.answers.residuals import ResidualsResponse
from labctl.answers.verification import VerificationResponse
from labctl.errors import BadInput, LabctlError
from labctl.fitting.criticism import Criticism, criticise, fit_means, open_question
from labctl.fitting.effects import Formula
from labctl.fitting.models.error_model import ErrorModel
from labctl.fitting.models.inversion import NotConverged
from labctl.progress import report_stage
from labctl.services.criticism.answer import answer_of, with_warnings
from labctl.services.criticism.decimated_readings import Decimated
from labctl.services.criticism.laws import proposed_laws
from labctl.services.criticism.measurements import Measurements, refuse_unmeasured
from labctl.services.criticism.residuals import residual_columns
from labctl.services.criticism.verification.of_version import verify
from labctl.services.effects import catalogue_with
from labctl.services.recordings.inspection import refuse_wrong
from labctl.store import CalibrationRecord, RecordingRow, Store


def held_sentences(model: ErrorModel) -> list[str]:
    """Return how the comparison treats the held coefficients of a version's model; nothing where none are held."""
    if not model.held.axes:
        return []
    listed = "; ".join(f"axis {axis}: {', '.join(names)}" for axis, names in model.held.axes.items())
    source = f" ({model.held.source})" if model.held.source else ""
    if model.forward().held.axes:
        text = (
            f"These coefficients are held at their values{source}, within their stated uncertainties, and are not "
            f"fitted: {listed}."
        )
    else:
        text = (
            f"The version holds these coefficients at their values{source}: {listed}. They belong to a law of the "
            "output; this comparison fits a law of the true rate, in which they are estimated."
        )
    return [text]


def evaluate(
    store: Store,
    calibration: CalibrationRecord,
    recordings: tuple[RecordingRow, ...],
    competing: Sequence[Formula],
    decimated: Decimated | None = None,
    seen: Callable[[Criticism], None] = lambda _: None,
    *,
    plans_next: bool = True,
) -> tuple[CriticismResponse, ResidualsResponse]:
    """Return the criticism of a version against recordings, and its residuals. Raises BadInput, NotEnoughData.

    `competing` formulas are added to the catalogue. `decimated` gives readings that are being read already. `seen` is
    given the criticism itself. Without `plans_next` no experiments and no laws are proposed: most of the time where
    the verdict is open.
    """
    catalogue, measured = catalogue_with(competing), Measurements(store, recordings, decimated)
    report_stage("inspecting the recording")
    warnings = measured.warnings
    for row in recordings:
        refuse_unmeasured(row, measured.of_each[row.id])
    applied = _applied(store, calibration, measured)
    try:
        model = model_of(calibration)
        fitted = fit_means(measured.points, model)  # while the readings are being read
        criticised = criticise(
            measured.readings, model, catalogue, fitted=fitted, is_decimated=measured.is_decimated,
            static=measured.static,
        )  # fmt: skip
    except NotConverged as error:
        job_title = f"criticism of version {calibration.version} on {measured.named}"
        refuse_wrong(warnings, job_title, accepted=False, insist=f"; without refitting, {error}")
        raise
    seen(criticised)
    columns = residual_columns(criticised.data, criticised.residuals, measured.points, measured.row.id, criticised.base)
    serial, version = calibration.serial, calibration.version
    experiments, laws, law_test = _proposals(store, recordings, criticised) if plans_next else ([], [], None)
    criticism = answer_of(serial, version, measured.recordings, criticised, experiments)
    text = [*criticism.text, *held_sentences(model)]
    criticism = criticism.model_copy(update={"text": text, "laws": laws, "law_test": law_test})
    return (
        with_warnings(criticism.model_copy(update={"applied": applied}), warnings),
        ResidualsResponse(
            serial=serial,
            version=version,
            recording=measured.row.id,
            recordings=list(measured.recordings),
            columns=columns,
        ),
    )


def _proposals(
    store: Store, rows: tuple[RecordingRow, ...], criticism: Criticism
) -> tuple[list[Experiment], list[ProposedLaw], LawTest | None]:
    """Return what to measure next, laws for what has no name, and the measurement that tells these apart."""
    experiments = _experiments(store, rows, criticism)
    return experiments, *proposed_laws(criticism, partial(_recipe_for_laws, store, rows, criticism))


def _experiments(store: Store, rows: tuple[RecordingRow, ...], criticism: Criticism) -> list[Experiment]:
    if open_question(criticism) is None:
        return []
    report_stage("checking experiments")
    from labctl.services.criticism.next_experiment import experiments_for  # noqa: PLC0415  it loads the drivers

    return experiments_for(store, rows, criticism)


def _recipe_for_laws(store: Store, rows: tuple[RecordingRow, ...], criticism: Criticism, channel: str) -> str:
    from labctl.services.criticism.next_experiment import recipe_for_laws  # noqa: PLC0415  it loads the drivers

    return recipe_for_laws(store, rows, criticism, channel)


def _applied(store: Store, calibration: CalibrationRecord, measured: Measurements) -> VerificationResponse | None:
    """Return the version without refitting on the recording, of several the newest; None where it cannot be applied."""
    try:
        return verify(store, calibration, measured.newest)
    except LabctlError:
        return None


def model_of(row: CalibrationRecord) -> ErrorModel:
    """Return the whole model of a version, also the effects that are not exported. Raises BadInput for an old row."""
    record = row.answer["model"]
    if "terms" not in record:
        raise BadInput(
            f"version {row.version} was made by an older version of labctl; fit the recording "
            "again, then criticise the new "
            "version"
        )
    return ErrorModel.from_dict(record)
