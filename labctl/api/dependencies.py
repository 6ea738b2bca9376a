"""What routes are given: the service, and the path, method and status of a command."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, TypeVar, cast

from fastapi import APIRouter, Depends, Request

from labctl.services.commands.command import Command
from labctl.services.lab_service import LabService


def get_service(request: Request) -> LabService:
    """Return the service that this application serves."""
    return cast(LabService, request.app.state.service)


ServiceDep = Annotated[LabService, Depends(get_service)]

EndpointT = TypeVar("EndpointT", bound=Callable[..., Any])


def command_route(
    router: APIRouter, command: Command[Any, Any], summary: str, **options: Any
) -> Callable[[EndpointT], EndpointT]:
    """Route a command: method, path, status and other responses are the command's own."""
    usual, *others = command.responses.items()
    if others:
        options["responses"] = {status: {"model": model} for status, model in others}
    return router.api_route(
        command.path.removeprefix(router.prefix),
        methods=[command.method],
        status_code=usual[0],
        summary=summary,
        **options,
    )
