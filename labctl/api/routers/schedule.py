"""The schedule: look, cancel. `POST /api/campaigns` with `at` or `cron` makes an entry."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from labctl.answers.schedule import ScheduledResponse
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.commands.registry import CANCEL_START
from labctl.services.commands.requests import ToStart
from labctl.services.schedule import queue

router = APIRouter(prefix="/api/schedule", tags=["campaigns"])


@router.get("", summary="Scheduled starts")
def schedule(
    service: ServiceDep, ended: Annotated[bool, Query(description="List starts that have ended as well.")] = False
) -> list[ScheduledResponse]:
    """Every waiting entry of the schedule, the next first, with the outcome of its past starts."""
    return queue.list_starts(service.store, ended=ended)


@router.get("/{start}", summary="One entry")
def start(start: int, service: ServiceDep) -> ScheduledResponse:
    """When the entry begins next, and the outcome of each past start."""
    return queue.start_status(service.store, start)


@command_route(router, CANCEL_START, "Cancel an entry")
def cancel(start: int, service: ServiceDep) -> ScheduledResponse:
    """Remove an entry from the schedule. A campaign that it has started continues."""
    return service.execute(CANCEL_START, ToStart(start))
