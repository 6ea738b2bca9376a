"""The schedule of campaign starts."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.plans import AttendanceResponse


class StartEventResponse(ResponseModel):
    """Outcome of one past start."""

    at: datetime
    due_at: datetime
    outcome: Literal["claimed", "started", "refused", "missed"]
    message: str
    campaign: int | None = None


class ScheduledResponse(ResponseModel):
    """A campaign that is to begin later."""

    id: int
    bench: str
    recipe: str
    state: str = Field(
        description="State of the entry: waiting, missed (a single start that was too late; it is listed until it is "
        "removed), ended (no start is to come) or cancelled."
    )
    due_at: datetime | None = Field(description="Time of the next start, in `time_zone`; null: no start is to come.")
    time_zone: str
    cron: str | None
    priority: int
    clip: bool
    hide: list[str] = Field(
        default_factory=list,
        description="Effects hidden in the units of a simulated bench, each as EFFECT or EFFECT=SIZE.",
    )
    fit: bool = Field(default=True, description="Whether the campaign ends in a draft if its recipe has [fit].")
    late_limit_s: float | None = Field(description="Limit of the entry on the delay of a start, s; null: none given.")
    missed_after_s: float | None = Field(
        default=None,
        description="Delay after which a start is missed and does not begin by itself, s: `late_limit_s`, else 3600 on "
        "a bench that is not simulated, without the time behind a running campaign; null: any delay is permitted.",
    )
    created_at: datetime
    note: str = ""
    history: list[StartEventResponse] = Field(default_factory=list)
    confirmed_by: str = Field(
        default="",
        description="Person who confirmed that the bench will be clear; empty: the bench is simulated, "
        "or no confirmation was requested.",
    )
    attendance: AttendanceResponse | None = Field(
        default=None, description="When the next start needs a person at the bench; null: never, or not known."
    )
