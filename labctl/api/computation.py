"""Long computations asked for over HTTP: cancelled when the client leaves, and followed stage by stage."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import AsyncIterator, Callable
from typing import Any, TypeVar

from fastapi import Request
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

from labctl.api.problems import as_problem
from labctl.errors import LabctlError
from labctl.progress import Cancelled, Progress, reporting_to
from labctl.services.schemas.base import ResponseModel

#: A computation looks this often whether its client is still there, s.
LOOK_S = 0.2
#: An open stream says that it is alive after this long without a stage, s.
HEARTBEAT_S = 10.0
#: Status of a request whose client left; no client reads it, a log may.
CLIENT_LEFT = 499

T = TypeVar("T")


async def while_connected(request: Request, work: Callable[[], T]) -> T:
    """Return what `work` returns, computed in a thread; at its next stage it is cancelled when the client leaves."""
    left = threading.Event()

    def stop_when_left(stage: str) -> None:
        if left.is_set():
            raise Cancelled(stage)

    task = _in_thread(work, stop_when_left)
    try:
        while not (await asyncio.wait({task}, timeout=LOOK_S))[0]:
            if await request.is_disconnected():
                left.set()
        return task.result()
    except Cancelled:
        raise HTTPException(CLIENT_LEFT, "the client left before the answer was computed") from None
    finally:
        left.set()


async def follow(request: Request, work: Callable[[], ResponseModel]) -> StreamingResponse:
    """Return server-sent events: `stage` for each stage of `work`, then `answer` or, where it fails, `problem`.

    At its next stage the work is cancelled when the client leaves. Raises what fails before the first stage.
    """
    loop, left = asyncio.get_running_loop(), threading.Event()
    stages: asyncio.Queue[str | None] = asyncio.Queue()

    def tell(stage: str) -> None:
        if left.is_set():
            raise Cancelled(stage)
        loop.call_soon_threadsafe(stages.put_nowait, stage)

    task = _in_thread(work, tell)
    task.add_done_callback(lambda _: stages.put_nowait(None))
    first = await stages.get()
    if first is None:
        task.result()

    async def stream() -> AsyncIterator[bytes]:
        try:
            shown, stage = None, first
            while stage is not None:
                if stage != shown:
                    yield _event("stage", json.dumps({"stage": stage}))
                shown = stage
                try:
                    stage = await asyncio.wait_for(stages.get(), HEARTBEAT_S)
                except TimeoutError:
                    yield b": alive\n\n"
            yield _result(task, request.url.path)
        finally:
            left.set()

    return StreamingResponse(stream(), media_type="text/event-stream", headers={"Cache-Control": "no-cache"})


def _in_thread(work: Callable[[], T], progress: Progress) -> asyncio.Task[T]:
    def reporting() -> T:
        with reporting_to(progress):
            return work()

    task = asyncio.ensure_future(run_in_threadpool(reporting))
    task.add_done_callback(lambda done: done.cancelled() or done.exception())  # also where its client has left
    return task


def _result(task: asyncio.Task[Any], path: str) -> bytes:
    try:
        return _event("answer", task.result().model_dump_json())
    except LabctlError as error:
        return _event("problem", bytes(as_problem(error, path).body).decode())


def _event(kind: str, data: str) -> bytes:
    return f"event: {kind}\ndata: {data}\n\n".encode()
