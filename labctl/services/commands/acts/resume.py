"""Continue a paused campaign, or resume an interrupted one."""

from __future__ import annotations

from labctl.answers.campaigns import CampaignResponse, ResumeRequest
from labctl.errors import Conflict
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.campaign_command import CampaignCommand, CommandOption
from labctl.services.commands.context import OPENS_BENCH_S, CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import CampaignResume


def _in_service(control: ServiceBench, context: CommandContext, request: CampaignResume) -> CampaignResponse:
    runner, body = control.bench_runner(), request.body
    if request.campaign is None:
        raise Conflict("state the number of the campaign to resume; `labctl campaign list` shows the numbers")
    paused = runner.runs(request.campaign)  # a resume after an interruption is recorded together with its rows
    answer = runner.resume(request.campaign, body)
    if paused:
        control.record(context, RESUME.name, request.campaign, f"{body.reason or 'goes on'} ({body.by})")
    return answer


def _in_foreground(control: Foreground, _: CommandContext, request: CampaignResume) -> CampaignResponse:
    return control.resume_campaign(request)


CAMPAIGN = CommandOption(
    name="campaign",
    kind=int | None,
    metavar="ID",
    is_argument=True,
    default=None,
    help="Number of the campaign; default: the newest interrupted campaign.",
)
POWER = CommandOption(
    name="power",
    kind=str | None,
    metavar="lost|kept",
    default=None,
    help="Whether the units lost power during the interruption; default: lost if this computer was restarted since "
    "then, else kept.",
)
DESCRIPTION = "Continue a paused campaign, or resume one that was interrupted, failed or aborted; safe state first."
RESUME = CampaignAct(
    name="resume",
    body=ResumeRequest,
    request_type=CampaignResume,
    summary="Resume a campaign",
    description=DESCRIPTION,
    in_service=_in_service,
    in_foreground=_in_foreground,
    wait_s=OPENS_BENCH_S,
    command_line=CampaignCommand(
        help=DESCRIPTION,
        options=(CAMPAIGN, "bench", POWER, "speed", "wire_log", "by"),
        default_campaign="resumable",
        runs_here=True,
    ),
)
