"""What a command is executed with: the store, the clock, and the control over campaigns."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from functools import cached_property
from typing import Protocol

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.services.commands.requests import CampaignResume, CampaignStart, ToBench, ToCampaign
from labctl.services.schemas.benches import BenchCheckResponse, CheckRequest
from labctl.services.schemas.campaigns import CampaignResponse, ConfirmRequest, ReasonRequest
from labctl.services.schemas.live import LiveEndRequest, LiveRequest, LiveStateResponse
from labctl.services.schemas.schedule import ScheduledResponse
from labctl.store import Store


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
    """Control over campaigns, by the process that executes the command."""

    def bench_of(self, asked: CampaignStart, /) -> BenchFile:
        """Return the bench that a start is for. Raises Conflict where the service has none."""
        ...

    def start(self, context: CommandContext, asked: CampaignStart, /) -> CampaignResponse:
        """Start a campaign now."""
        ...

    def schedule(self, context: CommandContext, asked: CampaignStart, /) -> ScheduledResponse:
        """Enter a campaign into the schedule."""
        ...

    def resume(self, context: CommandContext, asked: CampaignResume, /) -> CampaignResponse:
        """Continue a paused campaign, or resume an interrupted one."""
        ...

    def pause(self, context: CommandContext, asked: ToCampaign[ReasonRequest], /) -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        ...

    def abort(self, context: CommandContext, asked: ToCampaign[ReasonRequest], /) -> CampaignResponse:
        """End a campaign now, in the safe state."""
        ...

    def confirm(self, context: CommandContext, asked: ToCampaign[ConfirmRequest], /) -> CampaignResponse:
        """Answer the question that a campaign waits for. Raises StalePrompt for another one."""
        ...

    def check(self, context: CommandContext, asked: ToBench[CheckRequest], /) -> BenchCheckResponse:
        """Ask every instrument of a bench what it is and how it does; nothing moves."""
        ...

    def start_live(self, context: CommandContext, asked: LiveRequest, /) -> LiveStateResponse:
        """Begin a live calibration."""
        ...

    def end_live(self, context: CommandContext, asked: LiveEndRequest, /) -> LiveStateResponse:
        """End the live calibration that runs."""
        ...


class LiveControl(Protocol):
    """Control over live calibrations, by the process that reads their streams."""

    def start(self, request: LiveRequest) -> LiveStateResponse:
        """Begin one."""
        ...

    def end(self, request: LiveEndRequest) -> LiveStateResponse:
        """End the one that runs."""
        ...
