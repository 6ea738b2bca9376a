"""Whether the service is well."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.benches import BenchDescription


class HealthResponse(ResponseModel):
    """Whether the service is well: its database, its bench and its schedule."""

    status: Literal["ok", "look at the bench"]
    version: str
    database: str = Field(description="Name of the file, without folder, or of the database.")
    since: str = Field(description="When the service was started, ISO 8601, UTC.")
    bench: BenchDescription | None
    schedule_trouble: str = Field(description="Why the schedule could not be looked at; empty when all is well.")


class PulseResponse(ResponseModel):
    """What a caller without a key may know: that the service answers, and its version."""

    status: Literal["ok"] = "ok"
    version: str


class HeartbeatResponse(ResponseModel):
    """What every open page asks once a second."""

    status: Literal["ok"] = "ok"
    version: str
    heard_s: float = Field(description="How long ago the process that drives the bench was last heard of, s.")
