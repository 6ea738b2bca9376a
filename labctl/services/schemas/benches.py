"""Benches: status, checks and clearing."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from labctl.services.schemas.base import Request, ResponseModel


class ClearRequest(Request):
    """Who has inspected a bench whose safe state was not confirmed."""

    by: str = Field(min_length=1, max_length=200)
    reason: str = "inspected the bench"


class BenchStatus(ResponseModel):
    """A bench, and what its last safe state could not confirm."""

    name: str
    last_used_at: datetime
    unconfirmed: str = Field(
        default="", description="Until a person has inspected the bench and clears it; empty when all is well."
    )
    unconfirmed_at: datetime | None = None
    attempts: int = Field(default=0, description="How often the safe state was tried again since.")
    attempted_at: datetime | None = None
    confirmed_at: datetime | None = Field(
        default=None,
        description="When such an attempt confirmed the safe state; a person has still to inspect and clear it.",
    )
    left: list[str] = Field(
        default_factory=list, description="Campaigns that no process runs any more and that have not been ended."
    )


class DeviceCheck(ResponseModel):
    """What one instrument of a bench answered."""

    device: str
    ok: bool
    text: str
    driver: str = Field(default="", description="Name of its driver.")
    distribution: str = Field(default="", description="Distribution that the driver came from.")
    version: str = Field(default="", description="Version of that distribution.")


class BenchUnit(ResponseModel):
    """A unit on a bench."""

    name: str
    serial: str
    driver: str


class BenchDescription(ResponseModel):
    """A bench and what it is doing."""

    name: str
    simulated: bool
    latitude_deg: float | None
    units: list[BenchUnit]
    campaign: int | None = Field(description="The campaign that runs now.")
    unconfirmed: str = Field(description="What its last safe state could not confirm; empty when all is well.")
    heard_s: float = Field(
        default=0.0, description="How long ago the process that drives it was last heard of, s; 0: it is this one."
    )


class BenchResponse(BenchDescription):
    """The bench of a service, and what a person is asked before a campaign starts there."""

    start_questions: dict[str, str] = Field(description="Check -> question; empty for a simulated bench.")


class ShippedBench(ResponseModel):
    """A bench that comes with labctl, and what stands on it."""

    name: str
    text: str


class BenchCheckResponse(ResponseModel):
    """Whether every instrument of a bench answered."""

    bench: str
    ok: bool
    devices: list[DeviceCheck]
