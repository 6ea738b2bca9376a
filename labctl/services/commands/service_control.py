"""Control over campaigns in a service: its bench runner's, where the service has a bench."""

from __future__ import annotations

import threading
from contextvars import copy_context

from instruments.bench_config import BenchFile
from labctl.acting_user import actor
from labctl.errors import Conflict, NotFound, StoreError
from labctl.log import get_logger
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.unattended import abort_abandoned, not_running, record_action
from labctl.services.commands.context import CommandContext, LiveControl
from labctl.services.commands.requests import CampaignResume, CampaignStart, ToBench, ToCampaign
from labctl.services.schedule import queue
from labctl.services.schemas.benches import BenchCheckResponse, CheckRequest
from labctl.services.schemas.campaigns import CampaignResponse, ConfirmRequest, ReasonRequest
from labctl.services.schemas.live import LiveEndRequest, LiveRequest, LiveStateResponse
from labctl.services.schemas.schedule import ScheduledResponse
from labctl.stop.latch import StopRequest

log = get_logger()

NO_BENCH = "this service has no bench; start it with `labctl serve --bench FILE` or `--simulate`"


class ServiceControl:
    """Campaigns run in a thread of the bench runner; those that do not run there are only rows."""

    def __init__(self, runner: BenchRunner | None, live: LiveControl | None = None) -> None:
        self._runner, self._live = runner, live

    def _bench_runner(self) -> BenchRunner:
        """Return the runner of this service's bench. Raises Conflict when it has none."""
        if self._runner is None:
            raise Conflict(NO_BENCH)
        return self._runner

    def bench_of(self, _: CampaignStart) -> BenchFile:
        """Return this service's bench. Raises Conflict without one."""
        return self._bench_runner().bench

    def start(self, _: CommandContext, asked: CampaignStart) -> CampaignResponse:
        """Start a campaign on this service's bench. Raises Conflict without one, BenchBusy while another runs."""
        return self._bench_runner().start(asked.body)

    def schedule(self, context: CommandContext, asked: CampaignStart) -> ScheduledResponse:
        """Enter a campaign into the schedule of this service's bench."""
        return queue.add_start(context.store, asked.body, self._bench_runner().bench, context.now())

    def resume(self, context: CommandContext, asked: CampaignResume) -> CampaignResponse:
        """Continue a paused campaign, or resume an interrupted one on this service's bench."""
        runner, body = self._bench_runner(), asked.body
        if asked.campaign is None:
            raise Conflict("state the number of the campaign to resume; `labctl campaign list` shows the numbers")
        paused = runner.runs(asked.campaign)  # a resume after an interruption is recorded together with its rows
        answer = runner.resume(asked.campaign, body)
        if paused:
            self._record(context, "resume", asked.campaign, f"{body.reason or 'goes on'} ({body.by})")
        return answer

    def pause(self, context: CommandContext, asked: ToCampaign[ReasonRequest]) -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        if self._runner is None:
            raise not_running(context.store, asked.campaign, f"pause it ({asked.body.reason})")
        answer = self._runner.pause(asked.campaign, asked.body)
        self._record(context, "pause", asked.campaign, asked.body.text)
        return answer

    def abort(self, context: CommandContext, asked: ToCampaign[ReasonRequest]) -> CampaignResponse:
        """End a campaign now, in the safe state; one that does not run here is only closed.

        It is written down after it is done: neither a full disk nor a slow writer is a reason to go on.
        """
        reason = asked.body.text
        runner = self._runner
        if runner is None or not runner.runs_or_was_stopped(asked.campaign):
            new = StopRequest.new(actor().name, actor().via, reason, asked.campaign)
            left = None if runner is None else runner.stop_left(asked.campaign, new)
            stops = None if runner is None else runner.stop_latch
            return left or abort_abandoned(context.store, asked.campaign, reason, context.now(), stops)
        stop = runner.stop_of(asked.campaign) or StopRequest.new(actor().name, actor().via, reason, asked.campaign)
        answer = runner.abort(asked.campaign, stop)
        if missing := self._recorded(context, runner, stop):
            text = f"the campaign was aborted, but that is not in the audit trail{missing}"
            return answer.model_copy(update={"unrecorded": text})
        return answer

    @staticmethod
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

    def confirm(self, context: CommandContext, asked: ToCampaign[ConfirmRequest]) -> CampaignResponse:
        """Answer the question that a campaign waits for."""
        body = asked.body
        if self._runner is None:
            raise not_running(context.store, asked.campaign, f"answer question {body.prompt}")
        answer = self._runner.confirm(asked.campaign, body)
        said = f"{body.prompt}: {'done' if body.confirmed else 'cannot be done'}; {body.by}; {body.reason}"
        self._record(context, "confirm", asked.campaign, said)
        return answer

    def check(self, context: CommandContext, asked: ToBench[CheckRequest]) -> BenchCheckResponse:
        """Check this service's bench. Raises NotFound for another one, BenchBusy while a campaign runs."""
        runner = self._bench_runner()
        if asked.bench != runner.bench.name:
            raise NotFound(
                f"this service drives bench {runner.bench.name}, not {asked.bench!r}, and can check "
                f"only its own bench; name bench {runner.bench.name}, or ask the service of the other bench"
            )
        found = runner.check()
        context.store.audit.record(context.now(), "bench check", f"bench {found.bench}", {"ok": found.ok})
        return found

    def start_live(self, _: CommandContext, asked: LiveRequest) -> LiveStateResponse:
        """Begin a live calibration in this service."""
        return self._live_control().start(asked)

    def end_live(self, _: CommandContext, asked: LiveEndRequest) -> LiveStateResponse:
        """End the live calibration that runs in this service."""
        return self._live_control().end(asked)

    def _live_control(self) -> LiveControl:
        if self._live is None:
            raise Conflict("live calibrations run in the process that drives the bench; ask the service")
        return self._live

    @staticmethod
    def _record(context: CommandContext, action: str, campaign: int, reason: str) -> None:
        log.info("campaign.asked", campaign=campaign, act=action, reason=reason, by=actor().name)
        record_action(context.store, context.now(), action, campaign, reason)
