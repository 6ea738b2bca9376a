"""Benches: status, checks and clearing."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from labctl.services.schemas.base import Request, ResponseModel


class ClearRequest(Request):
    """Who has looked at a bench whose safe state was not confirmed."""

    by: str = Field(min_length=1, max_length=200)
    reason: str = "looked at the bench"


class BenchStatus(ResponseModel):
    """A bench, and what its last safe state could not confirm."""

    name: str
    last_used_at: datetime
    unconfirmed: str = Field(default="", description="Until a person has looked and clears it; empty when all is well.")
    unconfirmed_at: datetime | None = None
    attempts: int = Field(default=0, description="How often the safe state was tried again since.")
    attempted_at: datetime | None = None
    confirmed_at: datetime | None = Field(
        default=None,
        description="When such an attempt confirmed the safe state; a person has still to look and clear it.",
    )
    left: list[str] = Field(
        default_factory=list, description="Campaigns that no process runs any more and that have not been ended."
    )


class DeviceCheck(ResponseModel):
    """What one instrument of a bench answered."""

    device: str
    ok: bool
    text: str
