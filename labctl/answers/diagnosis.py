"""Diagnoses: a search for what is missing in a model, by one experiment on the bench after the other."""

from __future__ import annotations

from datetime import datetime
from typing import Literal, get_args

from pydantic import Field

from labctl.answers.base import Request, ResponseModel
from labctl.answers.campaigns import BenchCheck
from labctl.answers.common_fields import (
    BenchName,
    CriticismVerdict,
    HeldoutRms,
    NoiseFloor,
    PersonName,
    Reason,
    Serial,
    VersionNumber,
)

#: Where a diagnosis is.
DiagnosisState = Literal["criticising", "awaiting_confirmation", "measuring", "done", "stopped", "failed"]
#: What a diagnosis that is done has found.
DiagnosisOutcome = Literal[
    "one_cause", "several_causes", "adequate", "indistinguishable", "hours_spent", "unexplained", "insufficient_data",
    "cannot_be_done", "ended_by_person",
]  # fmt: skip
#: What came of an experiment.
ExperimentResult = Literal["measured", "cannot_be_done"]
DIAGNOSIS_STATES: tuple[DiagnosisState, ...] = get_args(DiagnosisState)

#: Bench hours of a diagnosis where none are given: those of a day and a night.
DEFAULT_HOURS = 24.0
MAX_HOURS = 1000.0


class DiagnosisRequest(Request):
    """How a unit is to be diagnosed."""

    hours: float = Field(
        default=DEFAULT_HOURS, gt=0, le=MAX_HOURS, allow_inf_nan=False, description="Largest time on the bench, h."
    )
    version: int | None = Field(
        default=None, ge=1, description="Version that is judged in every round; default: the unit's newest version."
    )
    recordings: list[int] = Field(
        default_factory=list,
        max_length=32,
        description="Recordings that the version is judged by at first; default: those that it was fitted to, and "
        "those of earlier diagnoses of the unit.",
    )
    at: str | None = Field(
        default=None,
        max_length=64,
        description="Time before which no experiment is begun, ISO 8601; a time without an offset is in `time_zone`. "
        "The recordings so far are judged at once. Default: as soon as the bench is free.",
    )
    time_zone: str | None = Field(
        default=None,
        max_length=100,
        description="Time zone of `at`, such as Europe/Berlin; default: that of the service's computer.",
    )


class ConfirmExperimentRequest(Request):
    """A person's answer to the experiment that a diagnosis proposes."""

    cleans_texts = True  # no answer is refused for the words that describe it
    round: int = Field(ge=1, description="Number of the round whose experiment is meant; another is refused.")
    by: PersonName
    confirmed: bool = Field(
        default=True,
        description="true: run the experiment; false: the experiment cannot be done, and the next best one is chosen.",
    )
    reason: Reason = ""
    checks: list[BenchCheck] = Field(
        default_factory=list,
        max_length=10,
        description="Needed to run it on a bench that is not simulated, all three: chamber_clear (the chamber is "
        "clear), table_free (the table is free to turn), limiter_on (the independent temperature limiter is on).",
    )


class ChosenExperiment(ResponseModel):
    """The experiment that a round has chosen, as the criticism proposed it."""

    separates: list[str] = Field(
        description="Ids of the effects that it separates: the leading one, then those that are distinguished from it."
    )
    do: str = Field(description="The experiment in words.")
    toml: str = Field(description="Its recipe, as a TOML file.")
    power: float = Field(
        description="Probability, before the experiment, that the verdict then names one cause alone (exact aliases "
        "are one), 0 to 1."
    )
    hours: float = Field(description="Expected time on the bench, h.")
    per_hour: float = Field(
        description="Expected information in the identity of the cause per hour of bench and person, bit/h."
    )


class DiagnosisRound(ResponseModel):
    """One criticism of all recordings so far, what was chosen by it, and what came of that."""

    number: int = Field(description="Number of the round, counted from 1.")
    at: datetime = Field(description="Time of the criticism.")
    recordings: list[int] = Field(description="Numbers of the recordings that were judged together.")
    verdict: CriticismVerdict = Field(description="Verdict of the criticism on all of them together.")
    named: list[str] = Field(description="Ids of the effects that the verdict is based on.")
    suspects: dict[str, float] = Field(
        description="Id of each effect that may be missing -> its probability, 0 to 1, most probable first."
    )
    spent_hours: float = Field(description="Time on the bench in all earlier rounds, h.")
    rms_dps: float | None = Field(
        description="RMS residual of the data set means by the model as refitted, deg/s; null: unknown."
    )
    heldout_rms_dps: HeldoutRms
    noise_floor_dps: NoiseFloor
    experiment: ChosenExperiment | None = Field(description="The experiment that was chosen; null: none, the end.")
    why: str = Field(description="The choice of the experiment, or the end, in a sentence.")
    confirmed_by: str = Field(
        description="Person who confirmed the experiment; empty: no person did, or none was asked."
    )
    campaign: int | None = Field(description="Number of the campaign of the experiment; null: none was started.")
    recording: int | None = Field(description="Number of the recording that it gave; null: none yet.")
    took_hours: float | None = Field(description="Time that the campaign took on the bench, h; null: it is not over.")
    came: ExperimentResult | None = Field(
        description="measured: the experiment was done; cannot_be_done: it failed or was refused, and is not proposed "
        "again; null: it is not over, or there is none."
    )
    came_text: str = Field(description="What was expected and what came, in a sentence; empty: it is not over.")


class DiagnosisResponse(ResponseModel):
    """A search for what is missing in a model, by one experiment after the other."""

    id: int = Field(description="Number of the diagnosis.")
    serial: Serial
    version: VersionNumber
    bench: BenchName
    hours: float = Field(description="Largest time on the bench, h.")
    spent_hours: float = Field(description="Time that its campaigns have taken on the bench so far, h.")
    by: str = Field(description="Who asked for it.")
    created_at: datetime = Field(description="Time at which it was asked for.")
    begins_at: datetime | None = Field(
        default=None, description="Time before which it begins no experiment; null: it begins at once."
    )
    state: DiagnosisState = Field(
        description="criticising: the recordings so far are judged; awaiting_confirmation: a person has to confirm the "
        "experiment; measuring: the campaign of the experiment runs; done: see `outcome`; stopped: a person stopped "
        "it, and it can be resumed; failed: it could not go on, see `why`, and it can be resumed."
    )
    ended: bool = Field(description="Whether it is done: stopped and failed ones can be resumed.")
    outcome: DiagnosisOutcome | None = Field(
        description="one_cause: one effect is missing; several_causes: the named effects are missing together; "
        "adequate: nothing is missing; indistinguishable: no experiment on this bench distinguishes the named effects; "
        "hours_spent: no experiment fits into the hours that are left; unexplained: no effect of the catalogue "
        "explains the residual; insufficient_data: too little was measured for a verdict; cannot_be_done: none of the "
        "experiments that would distinguish the named effects can be done; ended_by_person: a person "
        "ended it for good; null: it is not done."
    )
    named: list[str] = Field(description="Ids of the effects that the newest verdict is based on.")
    why: str = Field(description="The outcome, or the reason of a stop, in a sentence; empty while it goes on.")
    next: str = Field(description="What to do now, in a sentence; empty: nothing has to be done.")
    ended_at: datetime | None = Field(description="Time of its end; null: it has not ended.")
    recordings: list[int] = Field(description="Numbers of the recordings that it began with.")
    rounds: list[DiagnosisRound] = Field(description="Its rounds, oldest first.")
