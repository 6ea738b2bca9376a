"""Control over campaigns in a service: its bench runner's, where the service has a bench."""

from __future__ import annotations

from instruments.bench_config import BenchFile
from labctl.acting_user import actor
from labctl.errors import Conflict
from labctl.log import get_logger
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.unattended import record_action
from labctl.services.commands.context import BenchAct, CommandContext, LiveControl, RequestT, ResponseT
from labctl.services.commands.requests import CampaignStart
from labctl.texts import NO_BENCH

log = get_logger()

#: Why an act of a bench is refused, and how a service gets a bench.
WITHOUT_BENCH = f"{NO_BENCH}; start it with `labctl serve --bench FILE` or `--simulate`"


class ServiceControl:
    """Campaigns run in a thread of the bench runner; those that do not run there are only rows."""

    def __init__(self, runner: BenchRunner | None, live: LiveControl | None = None) -> None:
        self.runner, self._live = runner, live

    def bench_runner(self) -> BenchRunner:
        """Return the runner of this service's bench. Raises Conflict when it has none."""
        if self.runner is None:
            raise Conflict(WITHOUT_BENCH)
        return self.runner

    def bench_of(self, _: CampaignStart) -> BenchFile:
        """Return this service's bench. Raises Conflict without one."""
        return self.bench_runner().bench

    def own_bench(self) -> BenchFile | None:
        """Return this service's bench. Raises Conflict without one."""
        return self.bench_runner().bench

    def perform(self, act: BenchAct[RequestT, ResponseT], context: CommandContext, request: RequestT) -> ResponseT:
        """Carry out an act on this service's bench."""
        return act.in_service(self, context, request)

    def live_control(self) -> LiveControl:
        """Return the control over live calibrations. Raises Conflict in a process that does not drive the bench."""
        if self._live is None:
            raise Conflict("live calibrations run in the process that drives the bench; ask the service")
        return self._live

    @staticmethod
    def record(context: CommandContext, action: str, campaign: int, reason: str) -> None:
        """Write an act on a campaign into the log and the audit trail."""
        log.info("campaign.asked", campaign=campaign, act=action, reason=reason, by=actor().name)
        record_action(context.store, context.now(), action, campaign, reason)
