"""Continue a paused campaign, or resume an interrupted one."""

from __future__ import annotations

from labctl.answers.campaigns import CampaignResponse
from labctl.errors import Conflict
from labctl.services.commands.command import Command
from labctl.services.commands.context import OPENS_BENCH_S, BenchAct, CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import CampaignResume


def _in_service(control: ServiceBench, context: CommandContext, asked: CampaignResume) -> CampaignResponse:
    runner, body = control.bench_runner(), asked.body
    if asked.campaign is None:
        raise Conflict("state the number of the campaign to resume; `labctl campaign list` shows the numbers")
    paused = runner.runs(asked.campaign)  # a resume after an interruption is recorded together with its rows
    answer = runner.resume(asked.campaign, body)
    if paused:
        control.record(context, RESUME.name, asked.campaign, f"{body.reason or 'goes on'} ({body.by})")
    return answer


def _in_foreground(control: Foreground, _: CommandContext, asked: CampaignResume) -> CampaignResponse:
    return control.resume_campaign(asked)


RESUME = BenchAct(name="resume", in_service=_in_service, in_foreground=_in_foreground, wait_s=OPENS_BENCH_S)
RESUME_CAMPAIGN = Command(
    method="POST",
    path="/api/campaigns/{campaign}/resume",
    handler=RESUME.execute,
    responses={200: CampaignResponse},
)
