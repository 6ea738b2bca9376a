"""Hold a campaign after the present data set."""

from __future__ import annotations

from labctl.answers.campaigns import CampaignResponse, ReasonRequest
from labctl.services.campaigns.unattended import not_running
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.campaign_command import CampaignCommand
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToCampaign

Asked = ToCampaign[ReasonRequest]


def _in_service(control: ServiceBench, context: CommandContext, asked: Asked) -> CampaignResponse:
    if control.runner is None:
        raise not_running(context.store, asked.campaign, f"pause it ({asked.body.reason})")
    answer = control.runner.pause(asked.campaign, asked.body)
    control.record(context, PAUSE.name, asked.campaign, asked.body.text)
    return answer


def _in_foreground(_: Foreground, context: CommandContext, asked: Asked) -> CampaignResponse:
    """Raise Conflict: a campaign that this process could pause would hold the database."""
    raise not_running(context.store, asked.campaign, f"pause it ({asked.body.reason})")


PAUSE = CampaignAct(
    name="pause",
    body=ReasonRequest,
    asked=Asked,
    summary="Hold a campaign",
    description="Hold after the present data set. `wish` says that it was asked; `state` becomes `paused` when it "
    "holds.",
    command_line=CampaignCommand(
        help="Pause a running campaign after the present data set; the bench is still monitored.",
        defaults={"reason": "paused from the command line"},
    ),
    in_service=_in_service,
    in_foreground=_in_foreground,
    is_urgent=True,
)
