"""Carrying out a diagnosis, move by move. Each move is written down before it is carried out, and can be made again.

After a kill or a power cut the same call goes on: a criticism that was not written down is made again; the campaign of
a round is known by the name of its recipe, which no other campaign has, so that none is started twice.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

import tomli_w

from instruments.bench_config import BenchFile
from labctl.answers.criticism import CriticismResponse
from labctl.answers.diagnosis import ChosenExperiment, DiagnosisState, ExperimentResult
from labctl.errors import BadInput, LabctlError, NotEnoughData
from labctl.log import get_logger
from labctl.services.diagnosis import sentences
from labctl.services.diagnosis.next_move import DoneExperiment, End, Progress, next_move
from labctl.store import CampaignRow, DiagnosisRow, NewRound, RoundRow, Store
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.contracts.errors import PlanRefused, RecipeError

log = get_logger()


@dataclass(frozen=True)
class ExperimentStart:
    """The campaign of a round that is to be started."""

    recipe: str  #: TOML; its name belongs to this round alone
    bench: BenchFile
    confirmed_by: str  #: person who confirmed that a real bench is clear; empty: none has yet
    since: datetime  #: when it was decided, or confirmed
    begins_at: datetime | None = None  #: a time to come, at which it is to begin; None: as soon as the bench is free

    @property
    def name(self) -> str:
        """Name of its recipe, which no other campaign has."""
        return str(tomllib.loads(self.recipe)["name"])


class NotBegun(LabctlError):
    """An experiment was not begun in time on a real bench: a person has to confirm it again."""


class CannotBeDone(LabctlError):
    """The campaign of an experiment was refused when it was to begin."""


#: The bench cannot do the experiment: it is left out, and the next best is chosen.
REFUSALS = (PlanRefused, RecipeError, CannotBeDone)


class Laboratory(Protocol):
    """Who criticises for a diagnosis, and runs its campaigns."""

    def criticise(self, serial: str, version: int, recordings: list[int]) -> CriticismResponse:
        """Judge a version by several recordings together. Raises LabctlError."""
        ...

    def start(self, experiment: ExperimentStart) -> None:
        """Start a campaign, or run it to its end; one that was asked for already is not started again.

        One that begins later is entered into a schedule, where there is one.
        Raises one of `REFUSALS` where the bench cannot do it, NotBegun, LabctlError.
        """
        ...

    def go_on(self, campaign: CampaignRow, *, resumed: bool) -> bool:
        """Have a campaign that is not over go on; returns whether it is over now.

        `resumed`: a person has let a stopped diagnosis go on, which resumes an aborted campaign too.
        """
        ...


class DiagnosisRunner:
    """Makes the moves of diagnoses."""

    def __init__(
        self,
        open_store: Callable[[], AbstractContextManager[Store]],
        laboratory: Laboratory,
        now: Callable[[], datetime],
    ) -> None:
        """`open_store` opens the database for one write: a campaign in the foreground opens it for itself."""
        self._open_store, self._laboratory, self._now = open_store, laboratory, now

    def advance(self, diagnosis: int) -> bool:
        """Make the next move; returns whether there may be another one at once. Raises LabctlError."""
        with self._open_store() as store:
            row, rounds = store.diagnoses.get(diagnosis), store.diagnoses.rounds(diagnosis)
        if row.state == "criticising":
            self._judge(row, rounds)
            return True
        return row.state == "measuring" and self._measure(row, rounds[-1])

    def _judge(self, row: DiagnosisRow, rounds: list[RoundRow]) -> None:
        """Criticise all recordings together, and write down what is decided by it."""
        recordings = sorted({*row.recordings, *(each.recording for each in rounds if each.recording is not None)})
        try:
            criticism = self._laboratory.criticise(row.serial, row.version, recordings)
        except (BadInput, NotEnoughData) as error:
            if not rounds or rounds[-1].recording is None:
                raise
            text = sentences.not_judged(rounds[-1].recording, str(error))
            with self._open_store() as store:
                store.diagnoses.reject_recording(row.id, rounds[-1].number, text, self._now())
            return
        spent_hours = sum(each.took_hours or 0.0 for each in rounds)
        move = next_move(Progress(row.hours, spent_hours, _done(rounds)), criticism)
        number = len(rounds) + 1
        experiment = None
        state: DiagnosisState = "done"
        if not isinstance(move, End):
            named = move.experiment.model_copy(update={"toml": _named(move.experiment.toml, row.id, number)})
            experiment = named.model_dump(mode="json")
            state = "measuring" if _bench(row).is_simulated else "awaiting_confirmation"
        new = NewRound(
            number=number, recordings=recordings, verdict=criticism.verdict, named=list(criticism.named),
            suspects=_probabilities(criticism), spent_hours=spent_hours, rms_dps=criticism.error["rms_dps"],
            heldout_rms_dps=criticism.error["heldout_rms_dps"],
            noise_floor_dps=criticism.error["noise_floor_dps"], experiment=experiment, why=move.why,
        )  # fmt: skip
        with self._open_store() as store:
            store.diagnoses.add_round(row.id, new, state, move.outcome if isinstance(move, End) else "", self._now())
        log.info(
            "diagnosis.round", diagnosis=row.id, serial=row.serial, round=number, verdict=criticism.verdict,
            named=list(criticism.named), spent_hours=round(spent_hours, 3), decided=move.why,
        )  # fmt: skip

    def _measure(self, row: DiagnosisRow, last: RoundRow) -> bool:
        """Start the campaign of a round, have it go on, or write down its end."""
        experiment = ChosenExperiment.model_validate(last.experiment)
        if (campaign := self._campaign(row, last)) is None:
            later = row.begins_at if row.begins_at is not None and self._now() < row.begins_at else None
            start = ExperimentStart(experiment.toml, _bench(row), last.confirmed_by, last.since, later)
            try:
                self._laboratory.start(start)
            except REFUSALS as error:
                self._conclude(row, last, "cannot_be_done", sentences.not_done(str(error)))
                return True
            except NotBegun as error:
                with self._open_store() as store:
                    store.diagnoses.unconfirm(row.id, last.number, str(error), self._now())
                return False
            if (campaign := self._campaign(row, last)) is None:
                return False
        if campaign.state not in ENDED and not self._laboratory.go_on(campaign, resumed=False):
            return False
        self._conclude_campaign(row, last, campaign.id)
        return True

    def _campaign(self, row: DiagnosisRow, last: RoundRow) -> CampaignRow | None:
        """Return the campaign of a round, where it was written down, and note it."""
        with self._open_store() as store:
            campaign = campaign_of_round(store, last)
            if campaign is not None and last.campaign is None:
                store.diagnoses.note_campaign(row.id, last.number, campaign.id)
            return campaign

    def _conclude_campaign(self, row: DiagnosisRow, last: RoundRow, number: int) -> None:
        with self._open_store() as store:
            campaign = store.campaigns.get(number)
            took_hours = bench_hours(store, number)
            recording = store.recordings.get(campaign.recordings[row.serial]) if campaign.recordings else None
            dropped = None if recording is None else store.drafts.dropped(recording.id)
        if campaign.state not in ENDED:
            return
        if campaign.state is CampaignState.DONE and recording is not None and recording.datasets and dropped is None:
            self._conclude(row, last, "measured", sentences.measured(took_hours, number), recording.id, took_hours)
            return
        reason = dropped or campaign.reason or "it measured nothing"
        text = sentences.not_done(f"campaign {number} {campaign.state}: {reason}")
        self._conclude(row, last, "cannot_be_done", text, None, took_hours)

    def _conclude(
        self,
        row: DiagnosisRow,
        last: RoundRow,
        came: ExperimentResult,
        text: str,
        recording: int | None = None,
        took_hours: float = 0.0,
    ) -> None:
        with self._open_store() as store:
            store.diagnoses.conclude_round(row.id, last.number, came, text, recording, took_hours, self._now())
        log.info("diagnosis.experiment", diagnosis=row.id, round=last.number, came=came, text=text)


def campaign_of_round(store: Store, last: RoundRow) -> CampaignRow | None:
    """Return the campaign of a round, by its recipe where it is not noted yet; None where none was written down."""
    number = last.campaign
    if number is None and last.experiment is not None:
        number = store.diagnoses.campaign_of_recipe(recipe_name(last))
    return None if number is None else store.campaigns.get(number)


def recipe_name(last: RoundRow) -> str:
    """Return the name of the recipe of a round, which no other campaign has."""
    return str(tomllib.loads(ChosenExperiment.model_validate(last.experiment).toml)["name"])


def bench_hours(store: Store, campaign: int) -> float:
    """Return how long the steps of a campaign have had the bench, h: without the time of an interruption."""
    steps = store.campaigns.steps(campaign)
    lasted_s = [
        each.ended_s - each.started_s for each in steps if each.started_s is not None and each.ended_s is not None
    ]
    return sum(lasted_s) / 3600


def _bench(row: DiagnosisRow) -> BenchFile:
    return BenchFile.model_validate(dict(row.bench))


def _done(rounds: list[RoundRow]) -> list[DoneExperiment]:
    over = [
        (each, ChosenExperiment.model_validate(each.experiment))
        for each in rounds
        if each.experiment is not None and each.came
    ]
    return [
        DoneExperiment(experiment.toml, _came(each), experiment.hours, each.took_hours or 0.0)
        for each, experiment in over
    ]


def _came(row: RoundRow) -> ExperimentResult:
    return "measured" if row.came == "measured" else "cannot_be_done"


def _probabilities(criticism: CriticismResponse) -> Mapping[str, float]:
    """Return the probability of each suspect, the most probable first."""
    pairs = ((each["effect"], each["probability"]) for each in criticism.suspects)
    return dict(sorted(pairs, key=lambda pair: -pair[1]))


def _named(toml: str, diagnosis: int, number: int) -> str:
    """Return a recipe with the name that it has in one round of one diagnosis only; without a draft at its end."""
    document = {key: value for key, value in tomllib.loads(toml).items() if key != "fit"}
    return tomli_w.dumps({**document, "name": f"diagnosis-{diagnosis}-round-{number}"})
