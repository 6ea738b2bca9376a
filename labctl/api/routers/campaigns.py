"""Campaigns: start, status, plan, events and control."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request, Response
from fastapi.concurrency import run_in_threadpool

from labctl.answers.campaigns import CampaignRequest, CampaignResponse, EventResponse
from labctl.answers.course import CourseResponse
from labctl.answers.drafts import DraftsRequest, DraftsResponse
from labctl.answers.plans import CampaignPlanResponse
from labctl.answers.schedule import ScheduledResponse
from labctl.answers.sufficiency import UncertaintyCourseResponse
from labctl.api.act_routes import add_act_route
from labctl.api.computation import execute
from labctl.api.dependencies import ServiceDep, command_route
from labctl.api.event_stream import EventStream
from labctl.api.paging import AfterNumber, Limit, Search, in_parts
from labctl.services.campaigns.course import campaign_course
from labctl.services.campaigns.plan_view import campaign_plan
from labctl.services.commands.acts.catalogue import CAMPAIGN_ACTS
from labctl.services.commands.acts.start import START_CAMPAIGN
from labctl.services.commands.registry import MAKE_DRAFTS
from labctl.services.commands.requests import CampaignStart, ToCampaign
from labctl.services.sufficiency.answers import uncertainty_course
from labctl.store.paging import PageRequest

router = APIRouter(prefix="/api/campaigns", tags=["campaigns"])


@command_route(router, START_CAMPAIGN, "Run a recipe", response_model=CampaignResponse | ScheduledResponse)
def start(request: CampaignRequest, service: ServiceDep, response: Response) -> CampaignResponse | ScheduledResponse:
    """Run a recipe on this service's bench, now (201) or, with `at` or `cron`, later (202: an entry of the schedule).

    Refused where it exceeds a limit of the bench or of a unit; the answer names the limit.
    """
    answer = service.execute(START_CAMPAIGN, CampaignStart(request))
    response.status_code = START_CAMPAIGN.status_of(answer)
    return answer


@router.get("", summary="All campaigns")
def campaigns(
    request: Request,
    response: Response,
    service: ServiceDep,
    search: Search = "",
    limit: Limit = None,
    after: AfterNumber = None,
) -> list[CampaignResponse]:
    """Every campaign, newest first; `search` in recipe, bench, state and serial numbers.

    `X-Total-Count` is how many match; `Link` with rel="next" names the next part of a list that `limit` has cut.
    """
    return in_parts(request, response, service.campaigns(PageRequest(search, limit, after)))


@router.get("/{campaign}", summary="One campaign")
def campaign(campaign: int, service: ServiceDep) -> CampaignResponse:
    """State, step, progress, expected end, temperatures, rate and last fault."""
    return service.status(campaign)


@router.get("/{campaign}/plan", summary="Its steps")
def plan(campaign: int, service: ServiceDep) -> CampaignPlanResponse:
    """The whole plan of the campaign, with the outcome of each step."""
    return campaign_plan(service.store, campaign)


@router.get("/{campaign}/course", summary="Its temperatures")
def course(
    campaign: int,
    service: ServiceDep,
    points: Annotated[int, Query(ge=10, le=20_000, description="About as many times at most.")] = 1200,
    from_s: Annotated[float, Query(ge=0, description="First time, s since the start of the campaign.")] = 0.0,
) -> CourseResponse:
    """Temperatures of chamber and units while the campaign ran, also while it runs."""
    return campaign_course(service.store, campaign, points, from_s)


@router.get("/{campaign}/uncertainty", summary="Its U")
def uncertainty(campaign: int, service: ServiceDep) -> UncertaintyCourseResponse:
    """U of the campaign's fit as it fell with each data set, against the target of its recipe ([stop])."""
    return uncertainty_course(service.store, campaign)


for _act in CAMPAIGN_ACTS:
    add_act_route(router, _act)


@command_route(router, MAKE_DRAFTS, "Make its drafts")
async def make_drafts(campaign: int, request: DraftsRequest, service: ServiceDep) -> DraftsResponse:
    """Make the drafts of a campaign that is done, where they are still due; with `again` also those that failed.

    The service does this by itself when a campaign ends. Nothing is made twice, and nothing is certified.
    """
    return await execute(service, MAKE_DRAFTS, ToCampaign(campaign, request))


@router.get(
    "/{campaign}/events",
    summary="Follow a campaign",
    response_class=EventStream,
    responses={
        200: {
            "model": EventResponse | CampaignResponse,
            "description": "A campaign for `progress`, otherwise an event.",
        }
    },
)
async def events(
    campaign: int, service: ServiceDep, last_event_id: Annotated[int | None, Header()] = None
) -> EventStream:
    """Server-sent events from the first or, with `Last-Event-ID`, from the one after it, until the campaign ends.

    Between them `progress`, without an id: the present status, whenever it has changed.
    """

    async def stream() -> AsyncIterator[bytes]:
        async for update in service.follow(campaign, after=last_event_id or 0):
            if update is None:
                yield b": alive\n\n"
            elif isinstance(update, CampaignResponse):  # no id: it is not resumed from
                yield f"event: progress\ndata: {update.model_dump_json()}\n\n".encode()
            else:
                yield f"id: {update.id}\nevent: {update.kind}\ndata: {update.model_dump_json()}\n\n".encode()

    await run_in_threadpool(service.status, campaign)  # a frozen database must not keep the loop from a stop
    return EventStream(stream(), headers={"Cache-Control": "no-cache"})
