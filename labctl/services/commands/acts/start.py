"""Start a campaign now, or enter it into the schedule."""

from __future__ import annotations

from dataclasses import replace

from labctl.answers.campaigns import CampaignResponse
from labctl.answers.schedule import ScheduledResponse
from labctl.services.commands.command import Command
from labctl.services.commands.context import OPENS_BENCH_S, BenchAct, CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import CampaignStart
from labctl.services.planning.fit_rules import check_fit
from labctl.services.planning.loading import load_recipe
from labctl.services.schedule import queue


def _start_in_service(control: ServiceBench, _: CommandContext, request: CampaignStart) -> CampaignResponse:
    return control.bench_runner().start(request.body)


def _start_in_foreground(control: Foreground, _: CommandContext, request: CampaignStart) -> CampaignResponse:
    return control.run_campaign(request)


def _schedule_in_service(control: ServiceBench, context: CommandContext, request: CampaignStart) -> ScheduledResponse:
    return queue.add_start(context.store, request.body, control.bench_runner().bench, context.now())


def _schedule_in_foreground(control: Foreground, context: CommandContext, request: CampaignStart) -> ScheduledResponse:
    return control.schedule(context, request)


#: Raises Conflict where the service has no bench, BenchBusy while another campaign runs.
START = BenchAct(name="start", in_service=_start_in_service, in_foreground=_start_in_foreground, wait_s=OPENS_BENCH_S)
SCHEDULE = BenchAct(name="schedule", in_service=_schedule_in_service, in_foreground=_schedule_in_foreground)


def _start_campaign(context: CommandContext, request: CampaignStart) -> CampaignResponse | ScheduledResponse:
    """Start a campaign now, or enter it into the schedule: the only place where that is decided."""
    if request.body.fit:
        check_fit(load_recipe(request.body.recipe))
    if request.body.hide:
        from labctl.services.simulation.effect_sizes import with_sizes  # noqa: PLC0415  slow to import

        request = replace(request, body=with_sizes(request.body, context.control.bench_of(request)))
    if queue.is_scheduled(request.body):
        return SCHEDULE.execute(context, request)
    return START.execute(context, request)


START_CAMPAIGN: Command[CampaignStart, CampaignResponse | ScheduledResponse] = Command(
    method="POST",
    path="/api/campaigns",
    handler=_start_campaign,
    responses={201: CampaignResponse, 202: ScheduledResponse},
)
