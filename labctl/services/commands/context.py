"""What a command is executed with: the store, the clock, and the control over campaigns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, Generic, Protocol, TypeVar

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.answers.base import ResponseModel
from labctl.answers.benches import BenchCheckResponse
from labctl.answers.campaigns import CampaignResponse
from labctl.answers.live import LiveEndRequest, LiveRequest, LiveStateResponse
from labctl.answers.schedule import ScheduledResponse
from labctl.services.commands.requests import CampaignResume, CampaignStart
from labctl.store import Store

if TYPE_CHECKING:
    from labctl.services.campaigns.bench_runner import BenchRunner

#: How long a web process waits for an act that only writes, s: the engine may have the writing connection for a moment.
WRITES_S = 30.0
#: The same for one that opens a bench: every instrument is asked.
OPENS_BENCH_S = 180.0

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT", bound=ResponseModel)


class CommandContext:
    """The store is opened when the first command needs it: a campaign in the foreground opens its own."""

    def __init__(self, open_store: Callable[[], Store], clock: Clock, control: CampaignControl) -> None:
        self._open_store = open_store
        self.clock = clock
        self.control = control

    @cached_property
    def store(self) -> Store:
        """The store that commands change."""
        return self._open_store()

    def now(self) -> datetime:
        """Return the present time, UTC."""
        return self.clock.utc()


class CampaignControl(Protocol):
    """Control over benches and their campaigns, by the process that executes the command."""

    def bench_of(self, request: CampaignStart, /) -> BenchFile:
        """Return the bench that a start is for. Raises Conflict where the service has none."""
        ...

    def own_bench(self) -> BenchFile | None:
        """Return the bench that this service drives; None where no service runs, and each campaign names its bench.

        Raises Conflict where the service has none.
        """
        ...

    def perform(self, act: BenchAct[RequestT, ResponseT], context: CommandContext, request: RequestT, /) -> ResponseT:
        """Have an act carried out by the process that has the bench. Raises LabctlError."""
        ...


class LiveControl(Protocol):
    """Control over live calibrations, by the process that reads their streams."""

    def start(self, request: LiveRequest) -> LiveStateResponse:
        """Begin one."""
        ...

    def end(self, request: LiveEndRequest) -> LiveStateResponse:
        """End the one that runs."""
        ...


class ServiceBench(Protocol):
    """What an act may use in a service: the runner of its bench, where it has one, and its live calibrations."""

    @property
    def runner(self) -> BenchRunner | None:
        """The runner; None: this service has no bench."""
        ...

    def bench_runner(self) -> BenchRunner:
        """Return the runner. Raises Conflict without one."""
        ...

    def live_control(self) -> LiveControl:
        """Return the control over live calibrations. Raises Conflict in a process that does not drive the bench."""
        ...

    def record(self, context: CommandContext, action: str, campaign: int, reason: str) -> None:
        """Write an act on a campaign into the log and the audit trail."""
        ...


class Foreground(Protocol):
    """What an act may use in a process without a service: a campaign runs here and now, until it is over."""

    def run_campaign(self, request: CampaignStart) -> CampaignResponse:
        """Run a campaign."""
        ...

    def resume_campaign(self, request: CampaignResume) -> CampaignResponse:
        """Resume a campaign and run it."""
        ...

    def schedule(self, context: CommandContext, request: CampaignStart) -> ScheduledResponse:
        """Enter a campaign into the schedule of a bench."""
        ...

    def check(self, bench: str) -> BenchCheckResponse:
        """Check a bench by its file or its shipped name."""
        ...


@dataclass(frozen=True, kw_only=True)
class BenchAct(Generic[RequestT, ResponseT]):
    """Something that a person has a bench do."""

    name: str  #: in calls between processes and in the audit trail
    in_service: Callable[[ServiceBench, CommandContext, RequestT], ResponseT]  #: in the process that has the bench
    in_foreground: Callable[[Foreground, CommandContext, RequestT], ResponseT]  #: where no service runs
    wait_s: float = WRITES_S  #: how long another process of the service waits for it

    def execute(self, context: CommandContext, request: RequestT) -> ResponseT:
        """Have it carried out by the process that controls the bench. Raises LabctlError."""
        return context.control.perform(self, context, request)
