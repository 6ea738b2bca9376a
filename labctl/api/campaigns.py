"""Campaigns: start, look, follow, abort."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header, Response
from fastapi.responses import StreamingResponse

from labctl.api.rooms import HouseOf
from labctl.services import campaigns as services
from labctl.services.acts import CampaignRequest, ReasonRequest
from labctl.services.answers import CampaignAnswer, ScheduledAnswer
from labctl.services.scheduling import is_scheduled

router = APIRouter(prefix="/api/campaigns", tags=["campaigns"])


@router.post("", summary="Run a recipe", status_code=201, responses={202: {"model": ScheduledAnswer}})
def start(request: CampaignRequest, house: HouseOf, response: Response) -> CampaignAnswer | ScheduledAnswer:
    """Run a recipe on this service's bench, now (201) or, with `at` or `cron`, later (202: an entry of the schedule).

    Refused when the bench or a unit cannot do it, naming the limit.
    """
    if is_scheduled(request):
        response.status_code = 202
        return house.acts().schedule_campaign(request)
    return house.bench_runner().start(request)


@router.get("", summary="All campaigns")
def campaigns(house: HouseOf) -> list[CampaignAnswer]:
    """Every campaign, newest first."""
    return services.list_campaigns(house.store)


@router.get("/{campaign}", summary="One campaign")
def campaign(campaign: int, house: HouseOf) -> CampaignAnswer:
    """State, step, progress, expected end, temperatures, rate and last fault."""
    return house.status(campaign)


@router.post("/{campaign}/abort", summary="End a campaign")
def abort(campaign: int, request: ReasonRequest, house: HouseOf) -> CampaignAnswer:
    """End a running campaign now, in the safe state. What was measured is kept."""
    return house.acts().abort_campaign(campaign, request.reason)


@router.get("/{campaign}/events", summary="Follow a campaign", response_class=StreamingResponse)
async def events(
    campaign: int, house: HouseOf, last_event_id: Annotated[int | None, Header()] = None
) -> StreamingResponse:
    """Server-sent events from the first or, with `Last-Event-ID`, from the one after it, until the campaign ends."""

    async def stream() -> AsyncIterator[bytes]:
        async for event in house.follow(campaign, after=last_event_id or 0):
            yield f"id: {event.id}\nevent: {event.kind}\ndata: {event.model_dump_json()}\n\n".encode()

    house.status(campaign)
    return StreamingResponse(stream(), media_type="text/event-stream", headers={"Cache-Control": "no-cache"})
