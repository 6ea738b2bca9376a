"""An act on one campaign, from which its command, its route and its command of the command line are made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

from labctl.answers.base import Request
from labctl.answers.campaigns import CampaignResponse
from labctl.services.commands.acts.campaign_command import CampaignCommand
from labctl.services.commands.command import Command
from labctl.services.commands.context import BenchAct
from labctl.services.commands.requests import Addressed

AddressedT = TypeVar("AddressedT", bound=Addressed)


@dataclass(frozen=True, kw_only=True, eq=False)
class CampaignAct(BenchAct[AddressedT, CampaignResponse], Generic[AddressedT]):
    """An act on one campaign, which answers how the campaign is then."""

    body: type[Request]  #: of the request
    request_type: Callable[
        ..., AddressedT
    ]  #: the request with its address: of `campaign`, `body` and fields of its own
    summary: str  #: in the description of the API
    description: str
    command_line: CampaignCommand | None = None  #: None: its command is written by hand
    is_urgent: bool = False  #: over HTTP it has threads that other requests cannot fill

    @cached_property
    def command(self) -> Command[AddressedT, CampaignResponse]:
        """Its command, whose path ends with the name of the act."""
        return Command(
            method="POST",
            path=f"/api/campaigns/{{campaign}}/{self.name}",
            handler=self.execute,
            responses={200: CampaignResponse},
        )
