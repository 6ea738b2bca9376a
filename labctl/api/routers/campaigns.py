"""Campaigns: start, look, follow, abort."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header, Response
from fastapi.responses import StreamingResponse

from labctl.api.dependencies import ServiceDep
from labctl.services.campaigns.plan_view import campaign_plan
from labctl.services.schedule.queue import is_scheduled
from labctl.services.schemas.campaigns import (
    CampaignRequest,
    CampaignResponse,
    ConfirmRequest,
    ReasonRequest,
    ResumeRequest,
)
from labctl.services.schemas.plans import CampaignPlanResponse
from labctl.services.schemas.schedule import ScheduledResponse

router = APIRouter(prefix="/api/campaigns", tags=["campaigns"])


@router.post("", summary="Run a recipe", status_code=201, responses={202: {"model": ScheduledResponse}})
def start(request: CampaignRequest, service: ServiceDep, response: Response) -> CampaignResponse | ScheduledResponse:
    """Run a recipe on this service's bench, now (201) or, with `at` or `cron`, later (202: an entry of the schedule).

    Refused when the bench or a unit cannot do it, naming the limit.
    """
    if is_scheduled(request):
        response.status_code = 202
        return service.commands().schedule_campaign(request)
    return service.bench_runner().start(request)


@router.get("", summary="All campaigns")
def campaigns(service: ServiceDep) -> list[CampaignResponse]:
    """Every campaign, newest first."""
    return service.campaigns()


@router.get("/{campaign}", summary="One campaign")
def campaign(campaign: int, service: ServiceDep) -> CampaignResponse:
    """State, step, progress, expected end, temperatures, rate and last fault."""
    return service.status(campaign)


@router.get("/{campaign}/plan", summary="Its steps")
def plan(campaign: int, service: ServiceDep) -> CampaignPlanResponse:
    """The whole plan as it was written down, with what became of each step."""
    return campaign_plan(service.store, campaign)


@router.post("/{campaign}/abort", summary="End a campaign")
def abort(campaign: int, request: ReasonRequest, service: ServiceDep) -> CampaignResponse:
    """End a running campaign now, in the safe state. What was measured is kept."""
    return service.commands().abort_campaign(campaign, request.text)


@router.post("/{campaign}/pause", summary="Hold a campaign")
def pause(campaign: int, request: ReasonRequest, service: ServiceDep) -> CampaignResponse:
    """Hold after the present data set. `wish` says that it was asked; `state` becomes `paused` when it holds."""
    return service.commands().pause_campaign(campaign, request)


@router.post("/{campaign}/resume", summary="Let a campaign go on")
def resume(campaign: int, request: ResumeRequest, service: ServiceDep) -> CampaignResponse:
    """Let a paused campaign go on, or take up one that was interrupted, failed or aborted, safe state first."""
    return service.commands().resume_campaign(campaign, request)


@router.post("/{campaign}/confirm", summary="Answer a campaign's question")
def confirm(campaign: int, request: ConfirmRequest, service: ServiceDep) -> CampaignResponse:
    """Answer the question with this id; an answer to an older one is refused."""
    return service.commands().confirm(campaign, request)


@router.get("/{campaign}/events", summary="Follow a campaign", response_class=StreamingResponse)
async def events(
    campaign: int, service: ServiceDep, last_event_id: Annotated[int | None, Header()] = None
) -> StreamingResponse:
    """Server-sent events from the first or, with `Last-Event-ID`, from the one after it, until the campaign ends.

    Between them `progress`, without an id: where the campaign stands, whenever that has changed.
    """

    async def stream() -> AsyncIterator[bytes]:
        async for told in service.follow(campaign, after=last_event_id or 0):
            if told is None:
                yield b": alive\n\n"
            elif isinstance(told, CampaignResponse):  # no id: it is not resumed from
                yield f"event: progress\ndata: {told.model_dump_json()}\n\n".encode()
            else:
                yield f"id: {told.id}\nevent: {told.kind}\ndata: {told.model_dump_json()}\n\n".encode()

    service.status(campaign)
    return StreamingResponse(stream(), media_type="text/event-stream", headers={"Cache-Control": "no-cache"})
