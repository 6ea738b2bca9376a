"""A diagnosis as an answer: its rounds, what was expected of each experiment and what came, and what to do now."""

from __future__ import annotations

from itertools import zip_longest
from typing import cast

from labctl.answers.common_fields import CriticismVerdict
from labctl.answers.diagnosis import (
    ChosenExperiment,
    DiagnosisOutcome,
    DiagnosisResponse,
    DiagnosisRound,
    ExperimentResult,
)
from labctl.services.diagnosis import sentences
from labctl.store import DiagnosisRow, RoundRow, Store


def diagnosis_answer(store: Store, diagnosis: int) -> DiagnosisResponse:
    """Return a diagnosis with its rounds. Raises NotFound."""
    return _answer(store, store.diagnoses.get(diagnosis))


def diagnoses_of_unit(store: Store, serial: str) -> list[DiagnosisResponse]:
    """Return the diagnoses of a unit, newest first. Raises NotFound for an unknown unit."""
    store.units.get(serial)
    return [_answer(store, row) for row in store.diagnoses.of_unit(serial)]


def _answer(store: Store, row: DiagnosisRow) -> DiagnosisResponse:
    rounds = store.diagnoses.rounds(row.id)
    return DiagnosisResponse(
        id=row.id, serial=row.serial, version=row.version, bench=row.bench_name, hours=row.hours,
        spent_hours=sum(each.took_hours or 0.0 for each in rounds), by=row.by, created_at=row.created_at,
        begins_at=row.begins_at,
        state=row.state, ended=row.state == "done",
        outcome=cast(DiagnosisOutcome, row.outcome) if row.outcome else None,
        named=list(rounds[-1].named) if rounds else [], why=row.why if row.state in _EXPLAINED else "",
        next=_next(store, row, rounds), ended_at=row.ended_at, recordings=list(row.recordings),
        rounds=[_round(each, later) for each, later in zip_longest(rounds, rounds[1:])],
    )  # fmt: skip


#: States that have a reason.
_EXPLAINED = ("done", "stopped", "failed")


def _round(row: RoundRow, later: RoundRow | None) -> DiagnosisRound:
    """Return a round; `later` is the next one, whose criticism has judged what this one measured."""
    experiment = None if row.experiment is None else ChosenExperiment.model_validate(row.experiment)
    return DiagnosisRound(
        number=row.number, at=row.at, recordings=list(row.recordings), verdict=cast(CriticismVerdict, row.verdict),
        named=list(row.named), suspects=dict(row.suspects), spent_hours=row.spent_hours, rms_dps=row.rms_dps,
        heldout_rms_dps=row.heldout_rms_dps, noise_floor_dps=row.noise_floor_dps, experiment=experiment, why=row.why,
        confirmed_by=row.confirmed_by, campaign=row.campaign, recording=row.recording, took_hours=row.took_hours,
        came=cast(ExperimentResult, row.came) if row.came else None,
        came_text="" if experiment is None or not row.came else _result(experiment, row, later),
    )  # fmt: skip


def _result(experiment: ChosenExperiment, row: RoundRow, later: RoundRow | None) -> str:
    if row.came == "cannot_be_done":
        return row.came_text
    verdict = "" if later is None else f"; verdict then: {verdict_text(later.verdict, later.named)}"
    return f"{sentences.expected(experiment)}; {row.came_text}{verdict}"


def verdict_text(verdict: str, named: object) -> str:
    """Return a verdict with the effects that it is based on."""
    effects = ", ".join(cast(list[str], named))
    return f"{verdict}: {effects}" if effects else verdict


def _next(store: Store, row: DiagnosisRow, rounds: list[RoundRow]) -> str:
    if row.state == "awaiting_confirmation":
        return (
            f"check bench {row.bench_name}, then confirm the experiment of round {rounds[-1].number}, or answer that "
            "it cannot be done"
        )
    if row.state == "measuring" and row.begins_at is not None and rounds[-1].campaign is None:
        return (
            f"have the service of bench {row.bench_name} running (`labctl serve`): it begins the experiment of round "
            f"{rounds[-1].number}, not before {row.begins_at:%Y-%m-%d %H:%M %Z}"
        )
    if row.state in {"stopped", "failed"}:
        return f"`labctl diagnose {row.serial}` continues it; `labctl diagnose {row.serial} --end` ends it for good"
    if row.outcome in {"one_cause", "several_causes"}:
        made = _version_with(store, row, rounds[-1])
        if made is not None:
            return f"version {made} contains what was found; `labctl criticise {row.serial} --version {made}` judges it"
        of = ",".join(map(str, rounds[-1].recordings))
        effects = ",".join(rounds[-1].named)
        return f"`labctl improve {row.serial} --version {row.version} --recording {of} --add {effects}`"
    return ""


def _version_with(store: Store, row: DiagnosisRow, found: RoundRow) -> int | None:
    """Return the newest version that was made of the diagnosed one with what a round has found; None: there is none."""
    return max(
        (
            each.version
            for each in store.calibrations.of_unit(row.serial)
            if each.parent == row.version
            and set(found.recordings) <= set(each.recordings)
            and set(found.named) <= set(each.answer["model"]["effects"])
        ),
        default=None,
    )
