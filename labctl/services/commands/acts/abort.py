"""End a campaign now, in the safe state."""

from __future__ import annotations

import threading
from contextvars import copy_context
from typing import TYPE_CHECKING

from labctl.acting_user import actor
from labctl.answers.campaigns import CampaignResponse, ReasonRequest
from labctl.errors import StoreError
from labctl.services.campaigns.unattended import abort_abandoned
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToCampaign
from labctl.stop.latch import StopRequest

if TYPE_CHECKING:
    from labctl.services.campaigns.bench_runner import BenchRunner

AddressedRequest = ToCampaign[ReasonRequest]


def _in_service(control: ServiceBench, context: CommandContext, request: AddressedRequest) -> CampaignResponse:
    """End a campaign; one that does not run here is only closed.

    It is written down after it is done: neither a full disk nor a slow writer is a reason to go on.
    """
    reason, runner = request.body.text, control.runner
    if runner is None or not runner.runs_or_was_stopped(request.campaign):
        new = StopRequest.new(actor().name, actor().via, reason, request.campaign)
        left = None if runner is None else runner.stop_left(request.campaign, new)
        stops = None if runner is None else runner.stop_latch
        return left or abort_abandoned(context.store, request.campaign, reason, context.now(), stops)
    stop = runner.stop_of(request.campaign) or StopRequest.new(actor().name, actor().via, reason, request.campaign)
    answer = runner.abort(request.campaign, stop)
    if missing := _recorded(context, runner, stop):
        text = f"the campaign was aborted, but that is not in the audit trail{missing}"
        return answer.model_copy(update={"unrecorded": text})
    return answer


def _recorded(context: CommandContext, runner: BenchRunner, stop: StopRequest) -> str:
    """Write an abort down in a thread of its own; returns what keeps it from being written in time, or nothing."""
    failed: list[str] = []

    def record() -> None:
        try:
            runner.stop_latch.record(stop, context.now())
        except StoreError as error:
            failed.append(f": {error.cause}")

    thread = threading.Thread(target=copy_context().run, args=(record,), name="record-abort", daemon=True)
    thread.start()
    thread.join(runner.safe_within_s)
    return " yet: the database is busy" if thread.is_alive() else "".join(failed)


def _in_foreground(_: Foreground, context: CommandContext, request: AddressedRequest) -> CampaignResponse:
    """Close a campaign that no process runs any more; one that runs would hold the database."""
    return abort_abandoned(context.store, request.campaign, request.body.text, context.now())


#: Its command of the command line is written by hand: it stops the bench before it loads what declares the acts.
ABORT = CampaignAct(
    name="abort",
    body=ReasonRequest,
    request_type=AddressedRequest,
    summary="End a campaign",
    description="""End a running campaign now, in the safe state. The data measured so far are stored.

Answered within a second; `wish` is `abort` while the safe state is still being reached.""",
    in_service=_in_service,
    in_foreground=_in_foreground,
    is_urgent=True,
)
ABORT_CAMPAIGN = ABORT.command
