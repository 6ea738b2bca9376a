"""Whether the service is well, and its figures for a monitor."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import PlainTextResponse
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from labctl.answers.service import HealthResponse, HeartbeatResponse, PulseResponse
from labctl.api.access_policy import DECLARES_KEY
from labctl.api.dependencies import ServiceDep
from labctl.api.metrics import text_of

router = APIRouter(tags=["service"])


@router.get("/health", summary="State of the service", dependencies=[DECLARES_KEY])
def health(service: ServiceDep, request: Request) -> HealthResponse | PulseResponse:
    """Whether the service answers and in which version; with a key that may read, also the state of the database
    and of the bench."""
    return service.health() if request.state.caller is not None else service.pulse()


@router.get("/health/heartbeat", summary="Whether the service answers")
async def heartbeat(service: ServiceDep, request: Request) -> HeartbeatResponse:
    """Whether the service answers: what every open page asks once a second.

    No key is asked for and no database is read. `heard_s`, where present: seconds since the last answer of the
    bench process. `acts_at` is there for callers who may read only: it is an address of the laboratory.
    """
    answer = service.heartbeat()
    return answer if request.state.caller is not None else answer.model_copy(update={"acts_at": None})


@router.get("/metrics", summary="Metrics for monitoring", response_class=PlainTextResponse, dependencies=[DECLARES_KEY])
def metrics(service: ServiceDep, request: Request) -> PlainTextResponse:
    """Metrics in the text format of Prometheus."""
    text = text_of(service, request.app.state.request_figures)
    return PlainTextResponse(text, media_type=CONTENT_TYPE_PLAIN_0_0_4)
