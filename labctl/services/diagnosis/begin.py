"""Beginning a diagnosis, and what a person does to one: confirm, decline, stop, resume, end."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Literal

from instruments.bench_config import BenchFile
from labctl.acting_user import actor
from labctl.answers.campaigns import BENCH_CHECKS
from labctl.answers.diagnosis import (
    ConfirmExperimentRequest,
    DiagnosisRequest,
    DiagnosisResponse,
    DiagnosisState,
)
from labctl.errors import Conflict, StartNotConfirmed
from labctl.services.criticism.versions import version_of
from labctl.services.diagnosis import sentences
from labctl.services.diagnosis.advance import campaign_of_round, recipe_name
from labctl.services.diagnosis.answer import diagnosis_answer
from labctl.services.diagnosis.experiment_bench import bench_of_unit
from labctl.services.recordings.loading import chosen_rows
from labctl.services.schedule.planned_start import planned_start
from labctl.store import CalibrationRecord, CampaignRow, DiagnosisRow, NewDiagnosis, Store

#: States in which a process goes on by itself.
MOVING: tuple[DiagnosisState, ...] = ("criticising", "measuring")
#: States from which a diagnosis can be stopped.
STOPPABLE: tuple[DiagnosisState, ...] = ("criticising", "awaiting_confirmation", "measuring")

#: Whether a person has confirmed an experiment, who, and the reason why it cannot be done.
Reply = tuple[Literal["confirmed", "cannot_be_done"], str, str]


def confirmation_of(number: int, reply: Reply) -> ConfirmExperimentRequest:
    """Return what a person has answered at a terminal about the experiment of a round."""
    what, by, reason = reply
    return ConfirmExperimentRequest(
        round=number, by=by, confirmed=what == "confirmed", reason=reason, checks=list(BENCH_CHECKS)
    )


def begin(
    store: Store, serial: str, request: DiagnosisRequest, bench: BenchFile | None, at: datetime
) -> DiagnosisResponse:
    """Write down a diagnosis of a unit. `bench` is None where it is that of the unit's last campaign.

    Raises NotFound, BadInput (also for a time that is past), Conflict while another diagnosis of the unit is open.
    """
    version = version_of(store, serial, request.version)
    recordings = list(request.recordings) or _known_recordings(store, version)
    chosen = chosen_rows(store, serial, None, recordings)
    bench_file = bench_of_unit(store, serial, bench)
    new = NewDiagnosis(
        serial=serial, version=version.version, bench_name=bench_file.name, bench=bench_file.model_dump(mode="json"),
        hours=request.hours, recordings=[row.id for row in chosen], by=actor().name,
        begins_at=None if request.at is None else planned_start(request.at, None, request.time_zone, at)[0],
    )  # fmt: skip
    return diagnosis_answer(store, store.diagnoses.begin(new, at))


def _known_recordings(store: Store, version: CalibrationRecord) -> list[int]:
    """Return the recordings that a version was fitted to, and those of earlier diagnoses of the unit."""
    fitted = version.recordings or (() if version.recording is None else (version.recording,))
    earlier = [
        each.recording
        for diagnosis in store.diagnoses.of_unit(version.serial)
        for each in store.diagnoses.rounds(diagnosis.id)
        if each.recording is not None and each.came == "measured"
    ]
    return sorted({*fitted, *earlier})


def answer_experiment(
    store: Store, diagnosis: int, request: ConfirmExperimentRequest, at: datetime
) -> DiagnosisResponse:
    """Confirm the experiment that waits for a person, or write down that it cannot be done.

    Raises Conflict where another round, or none, waits; StartNotConfirmed without the checks of a real bench.
    """
    row, waiting = store.diagnoses.get(diagnosis), store.diagnoses.rounds(diagnosis)
    if row.state != "awaiting_confirmation" or waiting[-1].number != request.round:
        raise Conflict(
            f"diagnosis {diagnosis}: the experiment of round {request.round} waits for no confirmation (the diagnosis "
            f"is {row.state}, round {len(waiting)}); read the diagnosis again"
        )
    if not request.confirmed:
        reason = f"{request.reason or 'no reason was stated'} ({request.by})"
        store.diagnoses.conclude_round(
            diagnosis, request.round, "cannot_be_done", sentences.not_done(reason), None, 0.0, at
        )
    else:
        _refuse_unchecked(row, request.checks)
        store.diagnoses.confirm(diagnosis, request.round, request.by, at)
    return diagnosis_answer(store, diagnosis)


def _refuse_unchecked(row: DiagnosisRow, checks: Sequence[str]) -> None:
    missing = [each for each in BENCH_CHECKS if each not in checks]
    if missing and not BenchFile.model_validate(dict(row.bench)).is_simulated:
        raise StartNotConfirmed(
            f"diagnosis {row.id}: bench {row.bench_name} is not simulated, and {', '.join(missing)} of `checks` is not "
            "confirmed; check the bench, then confirm all three"
        )


def stop(store: Store, diagnosis: int, reason: str, at: datetime) -> DiagnosisResponse:
    """Stop a diagnosis, which can be resumed; its campaign is for the caller to stop. Raises Conflict."""
    store.diagnoses.halt(diagnosis, STOPPABLE, "stopped", reason, at)
    return diagnosis_answer(store, diagnosis)


def resume(store: Store, diagnosis: int, reason: str, at: datetime) -> DiagnosisResponse:
    """Let a diagnosis that was stopped or has failed go on where it was. Raises Conflict for any other."""
    row = store.diagnoses.get(diagnosis)
    rounds = store.diagnoses.rounds(diagnosis)
    open_round = rounds[-1] if rounds and rounds[-1].is_open else None
    if open_round is None:
        state: DiagnosisState = "criticising"
    else:
        is_asked = not BenchFile.model_validate(dict(row.bench)).is_simulated and not open_round.confirmed_by
        state = "awaiting_confirmation" if is_asked else "measuring"
    number = None if open_round is None else open_round.number
    store.diagnoses.resume(diagnosis, state, number, reason, at)
    return diagnosis_answer(store, diagnosis)


def open_campaign(store: Store, diagnosis: int) -> CampaignRow | None:
    """Return the campaign of the experiment that is not over; None for none."""
    rounds = store.diagnoses.rounds(diagnosis)
    return campaign_of_round(store, rounds[-1]) if rounds and rounds[-1].is_open else None


def withdraw_start(store: Store, diagnosis: int, at: datetime) -> None:
    """Take the experiment that is not over out of the schedule, where it waits there."""
    rounds = store.diagnoses.rounds(diagnosis)
    if rounds and rounds[-1].is_open:
        name = recipe_name(rounds[-1])
        for entry in store.starts.all(ended=False):
            if entry.recipe_name == name:
                store.starts.cancel(entry.id, at)


def end(store: Store, diagnosis: int, reason: str, at: datetime) -> DiagnosisResponse:
    """End a diagnosis for good. Raises Conflict for one that has ended."""
    store.diagnoses.end(diagnosis, "ended_by_person", reason, at)
    return diagnosis_answer(store, diagnosis)
