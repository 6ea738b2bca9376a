"""The task of one unit: a fit or a criticism with a store that is only read; its result is written by the coordinator.

A task and its result can be pickled. The same function does a task on every engine, so that the result is the same.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING

from instruments.clock import processor_s
from labctl.answers.calibrations import FitRequest
from labctl.answers.fleet import FleetJobRequest
from labctl.errors import BadInput, ComputationEnded, LabctlError
from labctl.services.cache import code_digest
from labctl.services.fleet.source import readings_from
from labctl.services.recordings.loading import chosen_rows, readings_question
from labctl.store import CalibrationRecord, FleetCoefficient, FleetFit, FleetResult, NewCalibration, RecordingRow, Store

if TYPE_CHECKING:
    from labctl.services.fleet.evidence import UnitEstimates


@dataclass(frozen=True)
class FleetTask:
    """What is to be done with one unit."""

    serial: str
    request: FleetJobRequest
    at: datetime  #: time of the result
    program: str = ""  #: digest of the program that the result is to be by; empty: any


@dataclass(frozen=True)
class Outcome:
    """The result of a task; a fit has the version that is to be kept, a criticism what it shows of every effect."""

    result: FleetResult
    fit: FleetFit | None = None
    estimates: UnitEstimates | None = None


def perform(store: Store, task: FleetTask) -> Outcome:
    """Do a task. An error of the unit is its result; raises ComputationEnded and what is wrong with the engine.

    Raises BadInput where a worker cannot use the storage that the readings are in.
    """
    begun_s = processor_s()
    refuse_other_program(task.program)
    with readings_from(store, task.request.source) as source:
        outcome = _performed(source, task)
    return replace(outcome, result=replace(outcome.result, processor_s=processor_s() - begun_s))


def _performed(store: Store, task: FleetTask) -> Outcome:
    try:
        if task.request.source:
            for row in chosen_rows(store, task.serial, None):
                store.recordings.check_readings(row.id)
        return _fitted(store, task) if task.request.kind == "fit" else _criticised(store, task)
    except ComputationEnded:
        raise
    except LabctlError as error:
        return Outcome(FleetResult(task.serial, "failed", reason=str(error)))
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001  one unit must not end the job of all
        reason = f"{type(error).__name__}: {error}; report this text to the maintainers of labctl"
        return Outcome(FleetResult(task.serial, "failed", reason=reason))


def refuse_other_program(program: str) -> None:
    """Raise BadInput where this process runs another program than the coordinator of a job."""
    if program and program != code_digest():
        raise BadInput(
            "a worker runs another version of labctl, numpy or scipy than the coordinator of the job, so its results "
            "would differ; install the same versions on all computers of the cluster, then start the job again"
        )


def skipped(store: Store, task: FleetTask) -> FleetResult | None:
    """Return why a unit has nothing to be computed: its newest result answers the same question; None: it is not so.

    The question is made of the recordings with their readings, the model or the version, and the program.
    """
    answered = store.fleet.answered(task.serial, task.request.kind)
    if answered is None or task.request.again:
        return None
    question, version = answered
    newest = store.calibrations.next_version(task.serial) - 1
    try:
        if version != newest or question != _question(store, task):
            return None
    except LabctlError:
        return None  # the task says what is wrong
    what = "is this fit" if task.request.kind == "fit" else "was criticised"
    reason = f"version {version} {what} already, by the same recordings, model and program"
    return FleetResult(task.serial, "skipped", question, version, reason)


def _question(store: Store, task: FleetTask) -> str:
    """Return the digest of all that the result of a task depends on. Raises LabctlError."""
    rows = chosen_rows(store, task.serial, None)
    if task.request.kind == "fit":
        return _fit_question(store, task.request, rows)
    return _criticism_question(store, _newest(store, task), rows)


def _fit_question(store: Store, request: FleetJobRequest, rows: tuple[RecordingRow, ...]) -> str:
    settings = {"model": request.model, "effects": request.effects, "accepted": request.accept_warnings}
    return _digest({"fit": settings, **readings_question(store, rows)})


def _criticism_question(store: Store, calibration: CalibrationRecord, rows: tuple[RecordingRow, ...]) -> str:
    return _digest({"criticise": calibration.hash, **readings_question(store, rows)})


def _digest(question: dict[str, object]) -> str:
    text = json.dumps({"by": code_digest(), **question}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _newest(store: Store, task: FleetTask) -> CalibrationRecord:
    from labctl.services.criticism.versions import version_of  # noqa: PLC0415  loaded by a worker, not by each command

    return version_of(store, task.serial, None)


def _fitted(store: Store, task: FleetTask) -> Outcome:
    from labctl.recording.info import measured_at  # noqa: PLC0415  loaded by a worker, not by each command
    from labctl.services.calibrations.fitting import fitted_unit  # noqa: PLC0415  as above

    job = task.request
    request = FitRequest(
        model=job.model or None, effects=list(job.effects), accept_warnings=job.accept_warnings
    )  # fmt: skip
    fitted = fitted_unit(store, task.serial, request, task.at)
    version = store.calibrations.next_version(task.serial)
    new = fitted.build(version)
    error = new.answer["error"]
    result = FleetResult(
        task.serial, "done", _fit_question(store, job, fitted.rows), version, rms_dps=_finite(error["rms_dps"]),
        noise_floor_dps=_finite(error["noise_floor_dps"]),
    )  # fmt: skip
    measured = measured_at(fitted.rows[-1].info)
    kept = FleetFit(version, new, new.model, measured, fitted.bench or "", list(coefficients_of(new)))
    return Outcome(result, kept)


def coefficients_of(new: NewCalibration) -> Iterator[FleetCoefficient]:
    """Yield the coefficients of a version; those of a temperature table by node, as `scale_factor@25`."""
    for axis, coefficients in new.answer["axes"].items():
        nodes = coefficients["coefficients"].get("temperature_c")
        for name, entry in coefficients["coefficients"].items():
            if not isinstance(entry, dict):
                continue
            values, u = entry["value"], entry["u"]
            if isinstance(values, list) and isinstance(u, list) and isinstance(nodes, list):
                for node, value, own_u in zip(nodes, values, u, strict=True):
                    yield FleetCoefficient(axis, f"{name}@{node:.4g}", value, own_u, entry["unit"])
            elif isinstance(values, float) and not isinstance(u, list):
                yield FleetCoefficient(axis, name, values, u, entry["unit"])


def _criticised(store: Store, task: FleetTask) -> Outcome:
    from labctl.fitting.criticism import Criticism, candidate_estimates  # noqa: PLC0415  loaded by a worker only
    from labctl.services.criticism.criticise import criticise_seen  # noqa: PLC0415  as above
    from labctl.services.fleet.evidence import UnitEstimates, packed  # noqa: PLC0415  as above

    calibration = _newest(store, task)
    rows = chosen_rows(store, task.serial, None)
    criticisms: list[Criticism] = []
    answer = criticise_seen(store, calibration, rows, criticisms.append)
    result = FleetResult(
        task.serial, "done", _criticism_question(store, calibration, rows), calibration.version,
        rms_dps=_finite(answer.error["rms_dps"]), noise_floor_dps=_finite(answer.error["noise_floor_dps"]),
        verdict=answer.verdict, named=list(answer.named),
    )  # fmt: skip
    campaign = rows[-1].campaign
    estimates = UnitEstimates(
        store.units.get(task.serial).model, calibration.model,
        "" if campaign is None else store.campaigns.get(campaign).bench_name,
        {axis: packed(each) for axis, each in candidate_estimates(criticisms[0]).items()},
    )  # fmt: skip
    return Outcome(result, estimates=estimates)


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
