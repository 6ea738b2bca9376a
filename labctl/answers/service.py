"""The service: whether it is well, and what its processes say once they are ready."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.benches import BenchDescription
from labctl.answers.common_fields import LabctlVersion

ReadOnlyState = Annotated[bool, Field(description="Whether this service only reads: every act is refused.")]
ActsAt = Annotated[
    str | None,
    Field(description="Address of the service that acts, as a service that only reads was given it; null: not given."),
]


class ReplicaResponse(ResponseModel):
    """How old the data of a replica of a PostgreSQL database are."""

    last_change_at: datetime | None = Field(
        description="When the newest change that the replica has was made; null: none since the replica was started."
    )
    age_s: float | None = Field(
        description="Time since then by the clock of the replica, s; the data are not older than that. Null: not known."
    )
    is_connected: bool = Field(description="Whether the replica is connected to the server that it copies.")


class HealthResponse(ResponseModel):
    """Whether the service is well: its database, its bench and its schedule."""

    status: Literal["ok", "look at the bench"] = Field(
        description="ok: all is well; else the last safe state of the bench is not confirmed."
    )
    version: LabctlVersion
    database: str = Field(description="Name of the database, or of its file without the folder.")
    since: str = Field(description="When the service was started, ISO 8601, UTC.")
    bench: BenchDescription | None = Field(description="The bench of the service; null: it has none.")
    schedule_trouble: str = Field(description="Why the schedule could not be read; empty when all is well.")
    read_only: ReadOnlyState = False
    acts_at: ActsAt = None
    replica: ReplicaResponse | None = Field(
        default=None, description="How old the data are; null: the database is no replica."
    )


class PulseResponse(ResponseModel):
    """What a caller without a key may know: that the service answers, and its version."""

    status: Literal["ok"] = Field(default="ok", description="Always ok: the service answers.")
    version: LabctlVersion


class HeartbeatResponse(ResponseModel):
    """What every open page asks once a second."""

    status: Literal["ok"] = Field(default="ok", description="Always ok: the service answers.")
    version: LabctlVersion
    heard_s: float = Field(description="Time since the last answer of the process that drives the bench, s.")
    not_stopped: str = Field(
        default="",
        description="What is known of a stop that was asked for more than 3 s ago while it is not confirmed that the "
        "table stands; empty: there is no such stop.",
    )
    read_only: ReadOnlyState = False
    acts_at: ActsAt = None
    replica: ReplicaResponse | None = Field(
        default=None,
        description="How old the data were when they were last asked for, at most some seconds ago; null: the database "
        "is no replica, or it has not answered yet.",
    )


class ServiceReady(ResponseModel):
    """A service that listens."""

    url: str = Field(description="Address of the service.")
    bench_pid: int | None = Field(
        description="Process id of the process that drives the bench; null for a service that only reads."
    )
    web_pid: int = Field(description="Process id of the process that answers over HTTP.")
    web_pids: list[int] = Field(description="Process ids of all processes that answer over HTTP.")
    unconfirmed: str = Field(description="What is wrong with the service's bench; empty when all is well.")
    cut_short: str = Field(
        description="Interrupted campaigns of that bench, and whether labctl resumes them; empty: none."
    )


class SimulatorReady(ResponseModel):
    """Simulated instruments that answer."""

    addresses: dict[str, str] = Field(description="For each instrument: the port or the address at which it answers.")
    bench_file: str | None = Field(description="Path of the bench file that was written; null: none was.")
