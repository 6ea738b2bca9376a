"""Hold a campaign after the present data set."""

from __future__ import annotations

from labctl.services.commands.acts.running import act_on_running
from procedures.contracts.control import Control

PAUSE = act_on_running(
    "pause",
    Control.pause,
    summary="Hold a campaign",
    description="Hold after the present data set. `wish` says that it was asked; `state` becomes `paused` when it "
    "holds.",
    command_help="Pause a running campaign after the present data set; the bench is still monitored.",
    default_reason="paused from the command line",
)
