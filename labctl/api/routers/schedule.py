"""The schedule: look, cancel. `POST /api/campaigns` with `at` or `cron` makes an entry."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.commands.registry import CANCEL_START
from labctl.services.commands.requests import ToStart
from labctl.services.schedule import queue
from labctl.services.schemas.schedule import ScheduledResponse

router = APIRouter(prefix="/api/schedule", tags=["campaigns"])


@router.get("", summary="What begins when")
def schedule(
    service: ServiceDep, ended: Annotated[bool, Query(description="Also entries that are over.")] = False
) -> list[ScheduledResponse]:
    """Every entry that waits, next first, with what became of its starts."""
    return queue.list_starts(service.store, ended=ended)


@router.get("/{start}", summary="One entry")
def start(start: int, service: ServiceDep) -> ScheduledResponse:
    """When it begins next, and what became of each start that fell due."""
    return queue.start_status(service.store, start)


@command_route(router, CANCEL_START, "Cancel an entry")
def cancel(start: int, service: ServiceDep) -> ScheduledResponse:
    """Take an entry out of the schedule. A campaign that it has begun runs on."""
    return service.execute(CANCEL_START, ToStart(start))
