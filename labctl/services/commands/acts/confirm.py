"""Answer the question that a campaign waits for."""

from __future__ import annotations

from labctl.answers.campaigns import CampaignResponse, ConfirmRequest
from labctl.services.campaigns.unattended import not_running
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToCampaign

Asked = ToCampaign[ConfirmRequest]


def _in_service(control: ServiceBench, context: CommandContext, asked: Asked) -> CampaignResponse:
    body = asked.body
    if control.runner is None:
        raise not_running(context.store, asked.campaign, f"answer question {body.prompt}")
    answer = control.runner.confirm(asked.campaign, body)
    said = f"{body.prompt}: {'done' if body.confirmed else 'cannot be done'}; {body.by}; {body.reason}"
    control.record(context, CONFIRM.name, asked.campaign, said)
    return answer


def _in_foreground(_: Foreground, context: CommandContext, asked: Asked) -> CampaignResponse:
    """Raise Conflict: no campaign asks anything here."""
    raise not_running(context.store, asked.campaign, f"answer question {asked.body.prompt}")


#: Raises StalePrompt for another question than the one that the campaign waits for.
CONFIRM = CampaignAct(
    name="confirm",
    body=ConfirmRequest,
    summary="Answer a campaign's question",
    description="Answer the question with this id; an answer to an older one is refused.",
    in_service=_in_service,
    in_foreground=_in_foreground,
)
CONFIRM_PROMPT = CONFIRM.command
