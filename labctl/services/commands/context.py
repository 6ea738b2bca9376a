"""What a command is executed with: the store, the clock, and the control over campaigns."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from functools import cached_property
from typing import TYPE_CHECKING, Protocol, TypeVar

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.services.commands.requests import CampaignStart
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.live import LiveEndRequest, LiveRequest, LiveStateResponse
from labctl.store import Store

if TYPE_CHECKING:
    from labctl.services.commands.acts.bench_act import BenchAct

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

    def bench_of(self, asked: CampaignStart, /) -> BenchFile:
        """Return the bench that a start is for. Raises Conflict where the service has none."""
        ...

    def perform(self, act: BenchAct[RequestT, ResponseT], context: CommandContext, asked: RequestT, /) -> ResponseT:
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
