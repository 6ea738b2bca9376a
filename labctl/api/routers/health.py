"""Is the service well, and its figures for a monitor."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import PlainTextResponse
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from labctl.api.access_policy import DECLARES_KEY
from labctl.api.dependencies import ServiceDep
from labctl.api.metrics import text_of
from labctl.services.schemas.service import HealthResponse, HeartbeatResponse, PulseResponse

router = APIRouter(tags=["service"])


@router.get("/health", summary="Is the service well?", dependencies=[DECLARES_KEY])
def health(service: ServiceDep, request: Request) -> HealthResponse | PulseResponse:
    """Whether the service answers and in which version; to those who may read, also the database and the bench."""
    return service.health() if request.state.caller is not None else service.pulse()


@router.get("/health/heartbeat", summary="Does the service answer?")
async def heartbeat(service: ServiceDep) -> HeartbeatResponse:
    """Whether the service answers: what every open page asks once a second.

    No key is asked for and no database is read. `heard_s`, where it is there: how long the bench was not heard.
    """
    return service.heartbeat()


@router.get("/metrics", summary="Figures for a monitor", response_class=PlainTextResponse, dependencies=[DECLARES_KEY])
def metrics(service: ServiceDep, request: Request) -> PlainTextResponse:
    """Counts in the text format that Prometheus reads."""
    text = text_of(service, request.app.state.request_figures)
    return PlainTextResponse(text, media_type=CONTENT_TYPE_PLAIN_0_0_4)
