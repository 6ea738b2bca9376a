"""A command that takes long, as a computation: done with a store alone, in whatever process has one."""

from __future__ import annotations

from datetime import datetime
from typing import TypeVar

from instruments.clock import VirtualClock
from labctl.answers.base import ResponseModel
from labctl.services.commands.command import Handler
from labctl.services.commands.context import CommandContext
from labctl.services.commands.service_control import ServiceControl
from labctl.store import Store

RequestT = TypeVar("RequestT")
ResponseT = TypeVar("ResponseT", bound=ResponseModel)


def carry_out(store: Store, handler: Handler[RequestT, ResponseT], request: RequestT, at: datetime) -> ResponseT:
    """Return what a command answers that was asked for at this instant, UTC; no campaign is controlled here."""
    return handler(CommandContext(lambda: store, VirtualClock(at), ServiceControl(None)), request)
