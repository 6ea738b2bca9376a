"""Commands executed on a store that a test holds, without a service."""

from __future__ import annotations

from instruments.clock import Clock
from labctl.services.commands.command import LocalExecutor
from labctl.services.commands.context import CommandContext
from labctl.services.commands.foreground_control import ForegroundControl
from labctl.store import Store


def local_executor(store: Store, clock: Clock) -> LocalExecutor:
    """Return an executor of commands on an open store."""
    return LocalExecutor(CommandContext(lambda: store, clock, ForegroundControl(store.location)))
