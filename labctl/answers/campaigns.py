"""Campaigns: start, control, status and events."""

from __future__ import annotations

from datetime import datetime
from typing import Literal, get_args

from pydantic import AwareDatetime, Field

from labctl.answers.base import LongText, Request, ResponseModel
from labctl.answers.campaign_parts import (
    AdviceResponse,
    DriverResponse,
    OutputResponse,
    PromptResponse,
    TurnResponse,
    WatchedLimitResponse,
)
from labctl.answers.common_fields import (
    BenchName,
    CampaignNumber,
    Clip,
    CutPersonName,
    OptionalPersonName,
    PersonName,
    Reason,
    RecipeName,
    StepCount,
)
from labctl.answers.drafts import DraftResponse
from labctl.answers.plans import RecipeSource
from labctl.answers.sufficiency import TargetResponse
from procedures.contracts.campaign_state import ACTIVE, ENDED, CampaignState

#: What a person confirms about a real bench before a campaign starts there.
BenchCheck = Literal["chamber_clear", "table_free", "limiter_on"]
BENCH_CHECKS: tuple[BenchCheck, ...] = get_args(BenchCheck)


class CampaignRequest(Request):
    """Which recipe to run on the service's bench."""

    recipe: RecipeSource
    clip: Clip = False
    hide: list[str] = Field(
        default_factory=list,
        max_length=20,
        description="Effects to hide in the simulated gyros, each as EFFECT or EFFECT=SIZE; SIZE is a number in the "
        "unit of the effect, or zN, such as z10, for a signal of N standard deviations of the noise on this plan.",
    )
    fit: bool = Field(
        default=True,
        description="Make a draft calibration at the end if the recipe has [fit]; false: make none, even if the "
        "recipe has [fit].",
    )
    at: str | None = Field(
        default=None,
        max_length=64,
        description="Time of the start, ISO 8601; a time without an offset is in `time_zone`. `now`: start as soon "
        "as the bench is free. Default: start at once, or status 409 if the bench is not free.",
    )
    cron: str | None = Field(
        default=None,
        max_length=200,
        description="Cron line of repeated starts: minute, hour, "
        "day of month, month, day of week, such as '30 2 * * MON'.",
    )
    time_zone: str | None = Field(
        default=None,
        max_length=100,
        description="Time zone of `at` and `cron`, such as Europe/Berlin; default: that of the service's computer.",
    )
    priority: int = Field(
        default=0,
        ge=-100,
        le=100,
        description="When several starts are due, the one with the highest priority begins first.",
    )
    late_limit_s: float | None = Field(
        default=None,
        ge=0,
        le=1e9,
        description="Largest delay of the start, s, from its due time: a start that is later is skipped. 0: every "
        "missed start is skipped. Default: on a simulated bench no limit, a missed start begins late, once; on a real "
        "bench 3600, without the time behind a running campaign.",
    )
    confirmed_by: OptionalPersonName = Field(
        default="",
        description="Needed for a bench that is not simulated: name of the person who confirms `checks`; for a later "
        "start, the person confirms that the checks will be met at that time.",
    )
    checks: list[BenchCheck] = Field(
        default_factory=list,
        max_length=10,
        description="Needed for a bench that is not simulated, all three: chamber_clear (the chamber is clear), "
        "table_free (the table is free to turn), limiter_on (the independent temperature limiter is on).",
    )


class StartRequest(Request):
    """Which recipe to run on which bench, here and now."""

    recipe: LongText = Field(description="Name of a shipped recipe, or the recipe itself as TOML text.")
    bench: str | None = Field(
        default=None,
        description="Path of a bench file, or the name of a shipped bench; default: the simulated bench that fits "
        "the recipe best.",
    )
    clip: Clip = False
    hide: list[str] = Field(
        default_factory=list, max_length=20, description="Has the same meaning as in `POST /api/campaigns`."
    )
    fit: bool = Field(default=True, description="Has the same meaning as in `POST /api/campaigns`.")
    speed: float | None = Field(
        default=None,
        gt=0,
        allow_inf_nan=False,
        description="Speed of a simulated bench, as a multiple of real time; default: as fast as possible.",
    )
    seed: int | None = Field(default=None, ge=0, description="Seed of the random numbers of a simulated bench.")
    simulated_start: AwareDatetime | None = Field(
        default=None, description="Date and time at which the time of a simulated bench begins."
    )
    confirmed_by: OptionalPersonName = Field(
        default="", description="Has the same meaning as in `POST /api/campaigns`."
    )
    checks: list[BenchCheck] = Field(
        default_factory=list, description="Has the same meaning as in `POST /api/campaigns`."
    )


class ReasonRequest(Request):
    """Why something is done to a campaign, or to a key, and by whom."""

    cleans_texts = True  # no abort is refused for the words that describe it
    reason: Reason = Field(min_length=1)
    by: CutPersonName = ""  # no abort is refused for its length

    @property
    def text(self) -> str:
        """Reason and person as one text."""
        return f"{self.reason} ({self.by})" if self.by else self.reason


class ConfirmRequest(Request):
    """An answer to the question with this id; an answer to an older question is refused."""

    cleans_texts = True  # as above
    prompt: str = Field(min_length=1, description="Id of the question that is answered.")
    by: PersonName
    confirmed: bool = Field(
        default=True,
        description="true: the requested action is done; false: the action cannot be done, and the campaign ends.",
    )
    again: bool = Field(
        default=False, description="Only for a turn by hand: true if the turn went wrong and is to be requested again."
    )
    reason: Reason = ""


class ResumeRequest(Request):
    """How a campaign that is paused or was interrupted goes on."""

    cleans_texts = True  # as above
    by: PersonName = "a person"
    reason: Reason = ""
    power: Literal["lost", "kept"] | None = Field(
        default=None,
        description="Whether the units lost power during the interruption; default: `lost` if the "
        "computer was restarted meanwhile, else `kept`.",
    )


class CampaignResponse(ResponseModel):
    """Where a campaign is."""

    id: CampaignNumber
    recipe: RecipeName
    bench: BenchName
    state: CampaignState = Field(description="State of the campaign.")
    reason: str = Field(
        default="",
        description="Why the campaign is in this state, such as the cause of a failure; empty: no reason is needed.",
    )
    step: int | None = Field(default=None, description="Number of the step, from 1.")
    steps: StepCount
    step_text: str = Field(default="", description="The present step in words; empty: none has begun.")
    progress: float = Field(ge=0, le=1, description="Share of the expected time that is over, 0 to 1.")
    expected_end: datetime | None = Field(
        default=None, description="Expected time of the end; null: the campaign has ended, or no step has begun."
    )
    t_s: float | None = Field(
        default=None, description="Campaign time: seconds since the campaign began, by the campaign's own clock."
    )
    chamber_c: float | None = Field(
        default=None,
        description="Temperature of the chamber, deg C; null: there is no chamber, or it was not read yet.",
    )
    setpoint_c: float | None = Field(
        default=None, description="Set point of the chamber, deg C; null: none was set, or not known."
    )
    gyro_c: float | None = Field(
        default=None,
        description="Temperature of the first unit that reports one, by its own thermometer, deg C; null: none was "
        "read.",
    )
    references: dict[str, float] = Field(
        default_factory=dict,
        description="Present values of the reference instruments, by column; empty if this process does not run "
        "the campaign.",
    )
    rate_dps: float | None = Field(default=None, description="Rate of the table, deg/s; null: no step has begun.")
    outputs: list[OutputResponse] = Field(
        default_factory=list,
        description="Present outputs of the units; empty if this process does not run the campaign.",
    )
    last_error: str | None = Field(default=None, description="Newest error event in words; null: there was none.")
    repeated: int = Field(default=0, ge=0, description="Data sets that were taken again.")
    stalled_s: float = Field(
        default=0.0, ge=0, description="How long the computer of the bench did not run labctl, s of real time."
    )
    wish: Literal["pause", "abort"] | None = Field(
        default=None, description="A pause or abort that was requested and is not carried out yet."
    )
    prompt: PromptResponse | None = Field(default=None, description="The question that waits for a person.")
    turn: TurnResponse | None = Field(
        default=None,
        description="The turn by hand that is under way; null: none, or this process does not run the campaign.",
    )
    links: dict[str, str] = Field(
        default_factory=dict, description="Instruments that answer late or not at all: name -> what is wrong."
    )
    limits: list[WatchedLimitResponse] = Field(
        default_factory=list,
        description="What the guards watched at the last poll; some are watched during data sets only. Empty: this "
        "process does not run the campaign.",
    )
    dropped: dict[str, str] = Field(
        default_factory=dict, description="Units excluded from the rest of the campaign: name -> reason."
    )
    abandoned: bool = Field(
        default=False,
        description="The process that ran the campaign is gone, and the campaign was neither resumed nor ended.",
    )
    started_at: datetime | None = Field(
        default=None, description="Time of the start; null: the campaign has not begun."
    )
    ended_at: datetime | None = Field(default=None, description="Time of the end; null: the campaign has not ended.")
    recordings: dict[str, int] = Field(default_factory=dict, description="serial -> recording")
    drafts: list[DraftResponse] = Field(
        default_factory=list,
        description="Draft calibrations made at the end of the campaign, one per recording; empty: the recipe "
        "has no [fit], the campaign is not done, or the response is a list.",
    )
    target: TargetResponse | None = Field(
        default=None,
        description="The U that ends the campaign before its plan does, and U so far; null: the recipe has no [stop], "
        "or the response is a list.",
    )
    drivers: dict[str, DriverResponse] = Field(
        default_factory=dict,
        description="For each table, chamber and gyro: the driver that was used when the campaign began.",
    )
    unrecorded: str = Field(
        default="",
        description="What could not be written to the database although the request was carried out; else empty.",
    )
    reported: dict[str, dict[str, str]] = Field(
        default_factory=dict,
        description="table, chamber or gyro name -> what it and its USB adapter reported as their "
        "identification when the campaign began: serial, firmware, revision, output_unit, adapter; instruments "
        "that reported nothing are left out.",
    )
    simulated_time: bool = Field(
        default=False, description="All times are those of a simulated bench, which may run faster than real time."
    )
    advice: AdviceResponse | None = Field(
        default=None, description="What happened and what to do; only for a failed campaign."
    )
    ended: bool = Field(
        default_factory=lambda given: given["state"] in ENDED,
        description="The campaign has ended; it goes on only if a person resumes it.",
    )
    active: bool = Field(
        default_factory=lambda given: given["state"] in ACTIVE and not given["abandoned"],
        description="A process runs the campaign: the state is planned, running, paused or waiting, and `abandoned` "
        "is false.",
    )
    resumable: bool | None = Field(
        default=None, description="Whether this service would accept `resume` now; null in lists."
    )
    resume_reason: str = Field(
        default="",
        description="Why `resume` would be refused; if it would be accepted: objections to resuming, or empty.",
    )


class EventResponse(ResponseModel):
    """Something that happened in a campaign."""

    id: int = Field(description="Number of the event.")
    at: datetime = Field(description="Time of the event.")
    t_s: float = Field(
        description="Campaign time of the event: seconds since the campaign began, by the campaign's own clock."
    )
    kind: str = Field(description="Kind of event, as a fixed word for programs.")
    level: Literal["info", "warning", "error"] = Field(description="Importance of the event.")
    message: str = Field(description="The event in words.")
    device: str | None = Field(default=None, description="The instrument or unit that the event concerns.")
    value: float | None = Field(default=None, description="Measured value, in `unit`.")
    limit: float | None = Field(default=None, description="Limit that `value` was compared with, in `unit`.")
    unit: str | None = Field(default=None, description="Unit of `value` and `limit`; null: the event has no value.")
