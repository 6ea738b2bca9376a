"""Campaigns: start, control, status and events."""

from __future__ import annotations

from datetime import datetime
from typing import Literal, get_args

from pydantic import Field

from labctl.services.schemas.base import Request, ResponseModel
from labctl.services.schemas.plans import RecipeSource
from procedures.contracts.campaign_state import ACTIVE, ENDED, CampaignState

#: What a person confirms about a real bench before a campaign starts there.
BenchCheck = Literal["chamber_clear", "table_free", "limiter_on"]
BENCH_CHECKS: tuple[BenchCheck, ...] = get_args(BenchCheck)


class CampaignRequest(Request):
    """Which recipe to run on the service's bench."""

    recipe: RecipeSource
    clip: bool = Field(default=False, description="Leave out points that the bench or a unit cannot do.")
    hide: list[str] = Field(
        default_factory=list,
        max_length=20,
        description="Of a simulated bench, now: effects hidden in its units, EFFECT or EFFECT=SIZE in its unit.",
    )
    at: str | None = Field(
        default=None,
        max_length=64,
        description="When to begin, ISO 8601; without offset in `time_zone`. `now`: as soon as the bench is free.",
    )
    cron: str | None = Field(default=None, max_length=200, description="Cron line of repeated starts: five fields.")
    time_zone: str | None = Field(
        default=None,
        max_length=100,
        description="Time zone of `at` and `cron`, such as Europe/Berlin; default: that of the service's computer.",
    )
    priority: int = Field(
        default=0,
        ge=-100,
        le=100,
        description="Of the starts that are due, the one with the highest number begins first.",
    )
    late_limit_s: float | None = Field(
        default=None,
        ge=0,
        le=1e9,
        description="How much later than due it may begin; 0: a missed start is skipped; absent: any time, once.",
    )
    confirmed_by: str = Field(
        default="",
        max_length=200,
        description="Of a bench that is not simulated: the person who confirms `checks`; of a later start, that they "
        "will hold then.",
    )
    checks: list[BenchCheck] = Field(
        default_factory=list,
        max_length=10,
        description="Of a bench that is not simulated, all three: the chamber is clear, the table is free, the "
        "independent temperature limiter is on.",
    )


class StartRequest(Request):
    """Which recipe to run on which bench, here and now."""

    recipe: str
    bench: str | None = None
    clip: bool = False
    speed: float | None = Field(
        default=None, gt=0, allow_inf_nan=False, description="Of a simulated bench; absent: as fast as it can."
    )
    seed: int | None = Field(default=None, ge=0, description="Speed of a simulated bench: X times real time.")
    confirmed_by: str = Field(default="", max_length=200, description="Same as in `POST /api/campaigns`.")
    checks: list[BenchCheck] = Field(default_factory=list, description="Same as in `POST /api/campaigns`.")


class ReasonRequest(Request):
    """Why something is done to a campaign, or to a key, and by whom."""

    reason: str = Field(min_length=1)
    by: str = Field(default="", max_length=200)

    @property
    def text(self) -> str:
        """Reason and person as one text."""
        return f"{self.reason} ({self.by})" if self.by else self.reason


class ConfirmRequest(Request):
    """An answer to the question with this id; an answer to an older question is refused."""

    prompt: str = Field(min_length=1)
    by: str = Field(min_length=1, max_length=200)
    confirmed: bool = Field(default=True, description="False: it cannot be done, and the campaign ends.")
    again: bool = Field(default=False, description="Of a turn by hand: it did not go well and is to be asked again.")
    reason: str = ""


class ResumeRequest(Request):
    """How a campaign that is paused or was interrupted goes on."""

    by: str = Field(default="a person", min_length=1, max_length=200)
    reason: str = ""
    power: Literal["lost", "kept"] | None = Field(
        default=None, description="Whether the units were off meanwhile; absent: yes when the host was."
    )


class PromptResponse(ResponseModel):
    """A question to a person; an answer names its id."""

    id: str
    kind: str
    text: str
    position: str | None = None
    turn_deg: float | None = Field(
        default=None, description="Of a turn by hand: its angle, positive counter-clockwise seen from above."
    )
    within_s: float | None = Field(
        default=None, description="How long the answer is waited for, by the campaign's clock; null: no limit."
    )


class TurnResponse(ResponseModel):
    """The turn by hand that is under way."""

    position: str = Field(description="The body axis that points up, about which the units are turned.")
    asked_deg: float = Field(description="Positive counter-clockwise seen from above.")
    phase: Literal["rest", "turn"] = Field(description="What the units are to do now.")
    attempt: int = Field(description="From 1; a turn that was refused is asked again.")
    came_deg: dict[str, float] = Field(
        default_factory=dict, description="Unit -> what has come out so far, by its nominal scale factor."
    )
    refused: str = Field(default="", description="Why the attempt before was refused; empty for the first.")


class OutputResponse(ResponseModel):
    """What one channel of a unit put out in the last moment, in the channel's unit."""

    gyro: str = Field(description="The unit's name on the bench.")
    channel: str
    unit: str
    mean: float
    std: float = Field(description="Of single readings.")
    n: int
    t_s: float = Field(description="Time of the last reading since the campaign began.")


class AdviceResponse(ResponseModel):
    """A failed campaign in words: three short sentences."""

    happened: str
    done: str = Field(description="What labctl did.")
    next: str = Field(description="What the operator must do next.")


class DriverResponse(ResponseModel):
    """The driver of an instrument, and the distribution that it came from."""

    driver: str
    distribution: str
    version: str


class CampaignResponse(ResponseModel):
    """Where a campaign is."""

    id: int
    recipe: str
    bench: str
    state: CampaignState
    reason: str = ""
    step: int | None = Field(default=None, description="Number of the step, from 1.")
    steps: int
    step_text: str = ""
    progress: float = Field(ge=0, le=1)
    expected_end: datetime | None = None
    t_s: float | None = Field(default=None, description="Campaign time: seconds since it began, on its own clock.")
    chamber_c: float | None = None
    setpoint_c: float | None = None
    gyro_c: float | None = None
    rate_dps: float | None = None
    outputs: list[OutputResponse] = Field(default_factory=list, description="Of a campaign that runs here, now.")
    last_error: str | None = None
    wish: Literal["pause", "abort"] | None = Field(
        default=None, description="A pause or abort that was requested and is not carried out yet."
    )
    prompt: PromptResponse | None = Field(default=None, description="The question that waits for a person.")
    turn: TurnResponse | None = Field(default=None, description="Of a campaign that runs here: the turn by hand, now.")
    links: dict[str, str] = Field(default_factory=dict, description="Instruments that answer late or not at all.")
    dropped: dict[str, str] = Field(default_factory=dict, description="Units that take no further part: name -> why.")
    abandoned: bool = Field(default=False, description="No process runs it any more, and it has no end.")
    started_at: datetime | None = None
    ended_at: datetime | None = None
    recordings: dict[str, int] = Field(default_factory=dict, description="serial -> recording")
    drivers: dict[str, DriverResponse] = Field(
        default_factory=dict, description="table, chamber or gyro name -> its driver when the campaign began."
    )
    unrecorded: str = Field(default="", description="Of a request that was carried out: what could not be written.")
    simulated_time: bool = Field(
        default=False, description="Its times are those of a simulated bench, which may run faster than real time."
    )
    advice: AdviceResponse | None = Field(default=None, description="Of a failed campaign.")
    ended: bool = Field(
        default_factory=lambda given: given["state"] in ENDED,
        description="Over: nothing happens any more unless a person resumes it.",
    )
    active: bool = Field(
        default_factory=lambda given: given["state"] in ACTIVE and not given["abandoned"],
        description="A process has it in hand: planned, running, paused or waiting, and not abandoned.",
    )
    resumable: bool | None = Field(
        default=None, description="Whether `resume` would be accepted here now; null in lists."
    )
    resume_reason: str = Field(
        default="", description="Why it would not be accepted, or the objections although it would be."
    )


class EventResponse(ResponseModel):
    """Something that happened in a campaign."""

    id: int
    at: datetime
    t_s: float
    kind: str
    level: Literal["info", "warning", "error"]
    message: str
    device: str | None = Field(default=None, description="The instrument or unit that it is about.")
    value: float | None = Field(default=None, description="What was measured, in `unit`.")
    limit: float | None = Field(default=None, description="Which limit it was compared with, in `unit`.")
    unit: str | None = None
