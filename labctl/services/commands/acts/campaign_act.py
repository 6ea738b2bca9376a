"""An act on one campaign, from which its command, its route and its command of the command line are made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

from labctl.answers.base import Request
from labctl.answers.campaigns import CampaignResponse
from labctl.services.commands.command import Command
from labctl.services.commands.context import BenchAct
from labctl.services.commands.requests import ToCampaign

BodyT = TypeVar("BodyT", bound=Request)


@dataclass(frozen=True, kw_only=True, eq=False)
class CampaignAct(BenchAct[ToCampaign[BodyT], CampaignResponse]):
    """An act on one campaign, which answers how the campaign is then."""

    body: type[BodyT]  #: of the request
    summary: str  #: in the description of the API
    description: str
    command_help: str = ""  #: of its command, which is made from the request; empty: that is written by hand
    command_defaults: Mapping[str, object] = field(default_factory=dict)  #: option -> default, on the command line only
    is_urgent: bool = False  #: over HTTP it has threads that other requests cannot fill

    @cached_property
    def command(self) -> Command[ToCampaign[BodyT], CampaignResponse]:
        """Its command, whose path ends with the name of the act."""
        return Command(
            method="POST",
            path=f"/api/campaigns/{{campaign}}/{self.name}",
            handler=self.execute,
            responses={200: CampaignResponse},
        )
