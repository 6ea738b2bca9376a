"""What routes are given: the service, and the path, method and status of a command."""

from __future__ import annotations

import asyncio
import contextvars
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated, TypeVar

from fastapi import APIRouter, Depends, Request, params
from fastapi.datastructures import Default

from labctl.services.commands.command import Command, RequestT, ResponseT
from labctl.services.lab_service import LabService

#: A stop of a bench that does not answer holds its thread for some seconds; the next stop must find another.
CONTROL_THREADS = 16

ResultT = TypeVar("ResultT")


async def get_service(request: Request) -> LabService:
    """Return the service that this application serves; without `async` each request would first go to a thread."""
    service: LabService = request.app.state.service
    return service


ServiceDep = Annotated[LabService, Depends(get_service)]


class ControlPool:
    """Threads for acts that end or hold a campaign: other requests, however many, cannot fill them."""

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(CONTROL_THREADS, thread_name_prefix="control")

    async def run(self, work: Callable[[], ResultT]) -> ResultT:
        """Return what `work` returns, in the name of the caller."""
        context = contextvars.copy_context()
        return await asyncio.get_running_loop().run_in_executor(self._threads, context.run, work)

    def close(self) -> None:
        """End the threads."""
        self._threads.shutdown()


async def get_control_pool(request: Request) -> ControlPool:
    """Return the threads that acts on campaigns are executed in."""
    control: ControlPool = request.app.state.control_pool
    return control


ControlPoolDep = Annotated[ControlPool, Depends(get_control_pool)]

EndpointT = TypeVar("EndpointT", bound=Callable[..., object])


def command_route(
    router: APIRouter,
    command: Command[RequestT, ResponseT],
    summary: str,
    *,
    dependencies: Sequence[params.Depends] | None = None,
    response_model: object = Default(None),
) -> Callable[[EndpointT], EndpointT]:
    """Route a command: method, path, status and other responses are the command's own."""
    usual, *others = command.responses.items()
    return router.api_route(
        command.path.removeprefix(router.prefix),
        methods=[command.method],
        status_code=usual[0],
        summary=summary,
        responses={status: {"model": model} for status, model in others},
        dependencies=dependencies,
        response_model=response_model,
    )
