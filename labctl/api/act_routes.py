"""The route of an act on a campaign, made from what the act says of itself."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import APIRouter

from labctl.answers.base import Request
from labctl.answers.campaigns import CampaignResponse
from labctl.api.dependencies import ControlPoolDep, ServiceDep, command_route
from labctl.services.commands.acts.campaign_act import AddressedT, CampaignAct
from labctl.services.lab_service import LabService


def add_act_route(router: APIRouter, act: CampaignAct[AddressedT]) -> None:
    """Route an act; one that is urgent is executed in threads that no other requests fill."""

    def perform(campaign: int, request: Request, service: LabService) -> CampaignResponse:
        return service.execute(act.command, act.request_type(campaign, request))

    if act.is_urgent:

        async def urgent(
            campaign: int, request: Request, service: ServiceDep, control: ControlPoolDep
        ) -> CampaignResponse:
            return await control.run(lambda: perform(campaign, request, service))

        endpoint: Callable[..., object] = urgent
    else:

        def usual(campaign: int, request: Request, service: ServiceDep) -> CampaignResponse:
            return perform(campaign, request, service)

        endpoint = usual
    endpoint.__name__ = act.name
    endpoint.__doc__ = act.description
    endpoint.__annotations__["request"] = act.body
    command_route(router, act.command, act.summary)(endpoint)
