"""The draft of a recording as it is stored, and the event that reports it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from labctl.json_types import JsonObject

DraftState = Literal["due", "fitted", "made", "failed"]
#: States of a draft that still has to be made.
OPEN: tuple[DraftState, ...] = ("due", "fitted")


@dataclass(frozen=True)
class DraftRow:
    """The draft of one recording."""

    recording: int
    campaign: int
    serial: str
    state: DraftState
    version: int | None
    at: datetime | None
    reason: str
    report: JsonObject | None


@dataclass(frozen=True)
class DraftEvent:
    """What the events of the campaign say of a draft."""

    message: str
    level: Literal["info", "warning"]
