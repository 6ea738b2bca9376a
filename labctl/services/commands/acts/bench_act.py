"""An act on a bench: its name, and what it does in a service and in the foreground of a process without one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Generic, TypeVar

from labctl.services.commands.command import Command
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToCampaign
from labctl.services.schemas.base import Request, ResponseModel
from labctl.services.schemas.campaigns import CampaignResponse

if TYPE_CHECKING:
    from labctl.services.commands.foreground_control import ForegroundControl
    from labctl.services.commands.service_control import ServiceControl

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT", bound=ResponseModel)
BodyT = TypeVar("BodyT", bound=Request)

#: How long a web process waits for an act that only writes, s: the engine may have the writing connection for a moment.
WRITES_S = 30.0
#: The same for one that opens a bench: every instrument is asked.
OPENS_BENCH_S = 180.0


@dataclass(frozen=True, kw_only=True)
class BenchAct(Generic[RequestT, ResponseT]):
    """Something that a person has a bench do."""

    name: str  #: in calls between processes and in the audit trail
    in_service: Callable[[ServiceControl, CommandContext, RequestT], ResponseT]  #: in the process that has the bench
    in_foreground: Callable[[ForegroundControl, CommandContext, RequestT], ResponseT]  #: where no service runs
    wait_s: float = WRITES_S  #: how long another process of the service waits for it

    def execute(self, context: CommandContext, asked: RequestT) -> ResponseT:
        """Have it carried out by whoever controls the bench. Raises LabctlError."""
        return context.control.perform(self, context, asked)


@dataclass(frozen=True, kw_only=True)
class CampaignAct(BenchAct[ToCampaign[BodyT], CampaignResponse]):
    """An act on one campaign, which answers how the campaign is then."""

    body: type[BodyT]  #: of the request
    summary: str  #: in the description of the API
    description: str
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
