"""Live calibration: begin, state, history, follow, end."""

from __future__ import annotations

from collections.abc import AsyncIterator

from fastapi import APIRouter
from fastapi.concurrency import run_in_threadpool

from labctl.answers.live import LiveEndRequest, LiveHistoryResponse, LiveRequest, LiveStateResponse
from labctl.api.dependencies import ServiceDep, command_route
from labctl.api.event_stream import EventStream
from labctl.services.commands.acts.live import END_LIVE, START_LIVE

router = APIRouter(prefix="/api/live", tags=["live"])


@command_route(router, START_LIVE, "Calibrate a unit live")
def start(request: LiveRequest, service: ServiceDep) -> LiveStateResponse:
    """Read a unit while a person turns it: on this service's bench, which it has meanwhile, or by a network stream.

    Refused while a campaign or another live calibration runs. At its target a version is fitted; however it ends, the
    readings until then become a recording.
    """
    return service.execute(START_LIVE, request)


@router.get("", summary="The live calibration")
def state(service: ServiceDep) -> LiveStateResponse:
    """How the one that runs stands, or how the last one ended: what is asked for, what is missing, and U."""
    return service.bench_access.live_state()


@router.get("/history", summary="How U fell")
def history(service: ServiceDep) -> LiveHistoryResponse:
    """U of every coefficient at every fit of it: all of them."""
    return service.bench_access.live_history()


@command_route(router, END_LIVE, "End the live calibration")
def end(request: LiveEndRequest, service: ServiceDep) -> LiveStateResponse:
    """End it: the readings so far become a recording, and, with `fit`, a version where they allow one.

    Answered within 10 s; `stage` is `storing` while the recording is still being stored.
    """
    return service.execute(END_LIVE, request)


@router.get(
    "/events",
    summary="Follow the live calibration",
    response_class=EventStream,
    responses={200: {"model": LiveStateResponse, "description": "Event `state`: how it stands, whenever it changes."}},
)
async def events(service: ServiceDep) -> EventStream:
    """Server-sent events until it has ended. A page that follows them watches it (`end_unwatched`)."""

    async def stream() -> AsyncIterator[bytes]:
        async for update in service.follow_live(first):
            if update is None:
                yield b": alive\n\n"
            else:
                yield f"event: state\ndata: {update.model_dump_json()}\n\n".encode()

    first = await run_in_threadpool(
        service.bench_access.live_state
    )  # a bench process that is silent is a problem document
    return EventStream(stream(), headers={"Cache-Control": "no-cache"})
