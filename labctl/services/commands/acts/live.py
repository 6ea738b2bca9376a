"""Begin and end a live calibration."""

from __future__ import annotations

from labctl.answers.live import LiveEndRequest, LiveRequest, LiveStateResponse
from labctl.errors import Conflict
from labctl.services.commands.command import Command
from labctl.services.commands.context import OPENS_BENCH_S, BenchAct, CommandContext, Foreground, ServiceBench


def _start_in_service(control: ServiceBench, _: CommandContext, request: LiveRequest) -> LiveStateResponse:
    return control.live_control().start(request)


def _start_in_foreground(_: Foreground, __: CommandContext, request: LiveRequest) -> LiveStateResponse:
    """Raise Conflict: `labctl live` calibrates in its own process."""
    raise Conflict(f"no service runs on this database; calibrate {request.serial or 'the unit'} with `labctl live`")


def _end_in_service(control: ServiceBench, _: CommandContext, request: LiveEndRequest) -> LiveStateResponse:
    return control.live_control().end(request)


def _end_in_foreground(_: Foreground, __: CommandContext, ___: LiveEndRequest) -> LiveStateResponse:
    """Raise Conflict: one that runs in a terminal is ended there."""
    raise Conflict("no service runs on this database; end `labctl live` with Ctrl-C in its terminal")


START_LIVE_ACT = BenchAct(
    name="start_live", in_service=_start_in_service, in_foreground=_start_in_foreground, wait_s=OPENS_BENCH_S
)
END_LIVE_ACT = BenchAct(name="end_live", in_service=_end_in_service, in_foreground=_end_in_foreground)

START_LIVE = Command(
    method="POST", path="/api/live/start", handler=START_LIVE_ACT.execute, responses={201: LiveStateResponse}
)
END_LIVE = Command(
    method="POST", path="/api/live/end", handler=END_LIVE_ACT.execute, responses={200: LiveStateResponse}
)
