"""Answer the question that a campaign waits for."""

from __future__ import annotations

from labctl.answers.campaigns import CampaignResponse, ConfirmRequest
from labctl.errors import BadInput
from labctl.services.campaigns.unattended import not_running
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.campaign_command import CampaignCommand, CommandOption, Values
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToCampaign

AddressedRequest = ToCampaign[ConfirmRequest]


def _in_service(control: ServiceBench, context: CommandContext, request: AddressedRequest) -> CampaignResponse:
    body = request.body
    if control.runner is None:
        raise not_running(context.store, request.campaign, f"answer question {body.prompt}")
    answer = control.runner.confirm(request.campaign, body)
    text = f"{body.prompt}: {'done' if body.confirmed else 'cannot be done'}; {body.by}; {body.reason}"
    control.record(context, CONFIRM.name, request.campaign, text)
    return answer


def _in_foreground(_: Foreground, context: CommandContext, request: AddressedRequest) -> CampaignResponse:
    """Raise Conflict: no campaign asks anything here."""
    raise not_running(context.store, request.campaign, f"answer question {request.body.prompt}")


def _request(values: Values) -> Values:
    """Return the answer that the options give. Raises BadInput for two answers."""
    is_declined = values["decline"] is not None
    if values["again"] and is_declined:
        raise BadInput("--again and --decline answer the same question; give one of them")
    return {
        "prompt": values["prompt"], "by": values["by"], "confirmed": not (is_declined or values["again"]),
        "again": values["again"], "reason": values["decline"] or "",
    }  # fmt: skip


QUESTION = CommandOption(
    name="prompt",
    kind=str,
    metavar="QUESTION",
    is_argument=True,
    help="Id of the question, as `labctl campaign status` or `labctl campaign watch` shows it.",
)
CAMPAIGN = CommandOption(
    name="campaign",
    kind=int | None,
    metavar="ID",
    default=None,
    help="Number of the campaign; default: the newest campaign.",
)
DECLINE = CommandOption(
    name="decline",
    kind=str | None,
    metavar="WHY",
    default=None,
    help="Answer that the action cannot be done, with the reason; the campaign ends.",
)
AGAIN = CommandOption(
    name="again", kind=bool, default=False, help="For a turn by hand: the turn went wrong; request it again."
)

#: Raises StalePrompt for another question than the one that the campaign waits for.
CONFIRM = CampaignAct(
    name="confirm",
    body=ConfirmRequest,
    request_type=AddressedRequest,
    summary="Answer a campaign's question",
    description="Answer the question with this id; an answer to an older one is refused.",
    in_service=_in_service,
    in_foreground=_in_foreground,
    command_line=CampaignCommand(
        help="Answer a campaign's question: done, or cannot be done. An answer to an older question is refused.",
        options=(QUESTION, CAMPAIGN, DECLINE, AGAIN, "by"),
        default_campaign="newest",
        request=_request,
        before="draft",
    ),
)
CONFIRM_PROMPT = CONFIRM.command
