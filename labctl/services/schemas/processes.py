"""What a process says once it is ready, to the program that started it."""

from __future__ import annotations

from pydantic import Field

from labctl.services.schemas.base import ResponseModel


class ServiceReady(ResponseModel):
    """A service that listens."""

    url: str
    bench_pid: int
    web_pid: int
    unconfirmed: str = Field(description="What is wrong with its bench; empty when all is well.")
    cut_short: str = Field(description="Which campaign was left there; empty when none was.")


class SimulatorReady(ResponseModel):
    """Simulated instruments that answer."""

    addresses: dict[str, str] = Field(description="Instrument -> port or address.")
    bench_file: str | None
