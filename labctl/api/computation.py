"""Long computations asked for over HTTP: ended when their client leaves, and followed stage by stage.

No request waits for a computation in one of the server's threads: those answer what is quick, such as `/health`.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from functools import partial
from typing import Any, ParamSpec, TypeVar

import anyio
import anyio.to_thread
from fastapi import Request, Response
from starlette.exceptions import HTTPException

from labctl.answers.base import ResponseModel
from labctl.answers.criticism import StageResponse
from labctl.api.event_stream import EventStream
from labctl.api.problems import as_problem
from labctl.api.validators import REVALIDATED, is_known, weak_tag
from labctl.errors import LabctlError
from labctl.progress import Progress
from labctl.services.cache import NotCached, cached_only
from labctl.services.commands.command import Command, RequestT, ResponseT
from labctl.services.computation.computation import Work
from labctl.services.computation.job import Call
from labctl.services.lab_service import LabService

#: An open stream says that it is alive after this long without a stage, s.
HEARTBEAT_S = 10.0
#: Status of a request whose client left; no client reads it, a log may.
CLIENT_LEFT = 499
#: Threads that look for cached results, and threads for long work on files.
LOOKING, FILES = 4, 4

ArgsT = ParamSpec("ArgsT")
T = TypeVar("T")


class Threads:
    """Limits on threads for work that may take longer than a quick answer; further work waits without a thread."""

    def __init__(self) -> None:
        """Make the limits; they belong to the event loop that runs."""
        self.looking = anyio.CapacityLimiter(LOOKING)
        self.files = anyio.CapacityLimiter(FILES)


def _threads(request: Request) -> Threads:
    state = request.app.state
    if not hasattr(state, "threads"):
        state.threads = Threads()
    threads: Threads = state.threads
    return threads


async def while_connected(
    request: Request, service: LabService, work: Work[..., T], *args: object, **named: object
) -> T:
    """Return what `work` returns, from the cache or computed; it is ended at once when the client leaves."""
    result = asyncio.ensure_future(_result(request, service, Call(work, args, named), lambda _: None))
    left = asyncio.ensure_future(_left(request))
    try:
        await asyncio.wait({result, left}, return_when=asyncio.FIRST_COMPLETED)
        if not result.done():
            raise HTTPException(CLIENT_LEFT, "the client has disconnected before the answer was computed")
        return result.result()
    finally:
        await _end(result, left)


async def follow(
    request: Request, service: LabService, work: Work[..., ResponseModel], *args: object, **named: object
) -> Response:
    """Return server-sent events: `stage` for each stage of `work`, then `answer` or, where it fails, `problem`.

    The work is ended at once when the client leaves. Raises what fails before the first stage. An answer that is there
    without a stage has an ETag; status 304 where the client has it.
    """
    loop = asyncio.get_running_loop()
    stages: asyncio.Queue[str | None] = asyncio.Queue()

    def tell(stage: str) -> None:
        with suppress(RuntimeError):  # the loop was closed meanwhile
            loop.call_soon_threadsafe(stages.put_nowait, stage)

    result = asyncio.ensure_future(_result(request, service, Call(work, args, named), tell))
    result.add_done_callback(lambda _: loop.call_soon(stages.put_nowait, None))
    left = asyncio.ensure_future(_left(request))
    left.add_done_callback(lambda _: result.cancel())
    first = await stages.get()
    if result.cancelled() or (first is None and result.exception() is not None):
        await _end(left)
        if result.cancelled():
            raise HTTPException(CLIENT_LEFT, "the client has disconnected before the computation began")
        result.result()
    if first is None:
        await _end(left)
        return _known_answer(request, _last_event(result, request.url.path))

    async def stream() -> AsyncIterator[bytes]:
        try:
            shown: str | None = None
            stage: str | None = first
            while stage is not None:
                if stage != shown:
                    yield _event("stage", StageResponse(stage=stage).model_dump_json())
                shown = stage
                try:
                    stage = await asyncio.wait_for(stages.get(), HEARTBEAT_S)
                except TimeoutError:
                    yield b": alive\n\n"
            if not result.cancelled():
                yield _last_event(result, request.url.path)
        finally:
            await _end(result, left)

    return EventStream(stream(), headers={"Cache-Control": REVALIDATED})


def _known_answer(request: Request, event: bytes) -> Response:
    """Return the event of an answer that was not computed now, with its ETag; 304 where the client has it."""
    headers = {"Cache-Control": REVALIDATED, "ETag": weak_tag([event])}
    if is_known(headers["ETag"], request.headers.get("if-none-match")):
        return Response(status_code=304, headers=headers)
    return Response(event, media_type=EventStream.media_type, headers=headers)


async def execute(service: LabService, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
    """Execute a command that computes. It was asked to be done: it goes on when the client leaves."""
    pending = service.submit(command, request)
    return await asyncio.wrap_future(pending.future)


async def with_files(request: Request, work: Callable[ArgsT, T], *args: ArgsT.args, **named: ArgsT.kwargs) -> T:
    """Return what long work on files returns, done in one of the threads for it."""
    limiter = _threads(request).files
    return await anyio.to_thread.run_sync(partial(work, *args, **named), limiter=limiter)


async def _result(request: Request, service: LabService, call: Call, progress: Progress) -> Any:
    """Return the result of some work; where it, or what it needs, is computed for another client, wait for that."""
    looking = _threads(request).looking
    while True:
        try:
            return await anyio.to_thread.run_sync(_cached, call, service, limiter=looking)
        except NotCached as miss:
            pending = service.computation.submit(
                call.work, *call.args, named=call.named, progress=progress, key=miss.question or repr(call)
            )
        try:
            with suppress(*(() if pending.same else (Exception,))):  # an error there may be of other work
                result = await asyncio.wrap_future(pending.future)
                if pending.same:
                    return result
        finally:
            pending.leave()


def _cached(call: Call, service: LabService) -> Any:
    with cached_only():
        return call(service.store)


async def _left(request: Request) -> None:
    """Wait until the client has left; the body of the request is read already, or there is none."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def _end(*tasks: asyncio.Future[Any]) -> None:
    """Cancel the tasks that are not done yet, and wait until all have ended."""
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


def _last_event(result: asyncio.Future[Any], path: str) -> bytes:
    try:
        return _event("answer", result.result().model_dump_json())
    except LabctlError as error:
        return _event("problem", bytes(as_problem(error, path).body).decode())


def _event(kind: str, data: str) -> bytes:
    return f"event: {kind}\ndata: {data}\n\n".encode()
