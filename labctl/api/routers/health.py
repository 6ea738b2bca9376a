"""Is the service well, and its figures for a monitor."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import PlainTextResponse

from labctl.api.dependencies import ServiceDep
from labctl.services.schemas.service import HealthResponse, HeartbeatResponse, PulseResponse

router = APIRouter(tags=["service"])


@router.get("/health", summary="Is the service well?")
def health(service: ServiceDep, request: Request) -> HealthResponse | PulseResponse:
    """Whether the service answers and in which version; to those who may read, also the database and the bench."""
    return service.health() if request.state.caller is not None else service.pulse()


@router.get("/health/heartbeat", summary="Does the service answer?")
async def heartbeat(service: ServiceDep) -> HeartbeatResponse:
    """Whether the service answers: what every open page asks once a second.

    No key is asked for and no database is read. `heard_s`, where it is there: how long the bench was not heard.
    """
    return service.heartbeat()


@router.get("/metrics", summary="Figures for a monitor", response_class=PlainTextResponse)
def metrics(service: ServiceDep) -> str:
    """Counts in the text format that Prometheus reads."""
    return "".join(f"# TYPE {name} gauge\n{name} {value}\n" for name, value in service.metrics().items())
