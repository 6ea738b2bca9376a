"""The schedule of campaign starts."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import BenchName, Clip, EndsInDraft, RecipeName
from labctl.answers.plans import AttendanceResponse


class StartEventResponse(ResponseModel):
    """Outcome of one past start."""

    at: datetime = Field(description="Time at which the service acted on the start.")
    due_at: datetime = Field(description="Time at which the start was due, in the time zone of the entry.")
    outcome: Literal["claimed", "started", "refused", "missed"] = Field(
        description="claimed: a service is starting the campaign; started: the campaign began; refused: it could "
        "not begin; missed: it was too late."
    )
    message: str = Field(description="The outcome in words.")
    campaign: int | None = Field(default=None, description="Campaign that began; null: none did.")


class ScheduledResponse(ResponseModel):
    """A campaign that is to begin later."""

    id: int = Field(description="Number of the entry.")
    bench: BenchName
    recipe: RecipeName
    state: str = Field(
        description="State of the entry: waiting, missed (a single start that was too late; it is listed until it is "
        "removed), ended (no start is to come) or cancelled."
    )
    due_at: datetime | None = Field(description="Time of the next start, in `time_zone`; null: no start is to come.")
    time_zone: str = Field(description="Time zone of the entry, such as Europe/Berlin.")
    cron: str | None = Field(description="Cron line of repeated starts; null: a single start.")
    priority: int = Field(
        description="Priority, -100 to 100: of several starts that are due, the one with the highest begins first."
    )
    clip: Clip
    hide: list[str] = Field(
        default_factory=list,
        description="Effects hidden in the units of a simulated bench, each as EFFECT or EFFECT=SIZE.",
    )
    fit: EndsInDraft = True
    late_limit_s: float | None = Field(description="Limit of the entry on the delay of a start, s; null: none given.")
    missed_after_s: float | None = Field(
        default=None,
        description="Delay after which a start is missed and does not begin by itself, s: `late_limit_s`, else 3600 on "
        "a bench that is not simulated, without the time behind a running campaign; null: any delay is permitted.",
    )
    created_at: datetime = Field(description="Time at which the entry was made.")
    note: str = Field(
        default="", description="Remark on the entry, such as the time zone that was assumed; empty: none."
    )
    history: list[StartEventResponse] = Field(default_factory=list, description="Outcome of each past start.")
    confirmed_by: str = Field(
        default="",
        description="Person who confirmed that the bench will be clear; empty: the bench is simulated, "
        "or no confirmation was requested.",
    )
    attendance: AttendanceResponse | None = Field(
        default=None, description="When the next start needs a person at the bench; null: never, or not known."
    )
