"""Acts that ask a running campaign for something, with a reason: what they have in common."""

from __future__ import annotations

from collections.abc import Callable

from labctl.answers.campaigns import CampaignResponse, ReasonRequest
from labctl.services.campaigns.unattended import not_running
from labctl.services.commands.acts.campaign_act import CampaignAct
from labctl.services.commands.acts.campaign_command import CampaignCommand
from labctl.services.commands.context import CommandContext, Foreground, ServiceBench
from labctl.services.commands.requests import ToCampaign
from procedures.contracts.control import Control

AddressedRequest = ToCampaign[ReasonRequest]


def act_on_running(
    name: str,
    ask: Callable[[Control, str], None],
    *,
    summary: str,
    description: str,
    command_help: str,
    default_reason: str,
) -> CampaignAct[AddressedRequest]:
    """Return an act that gives the reason to `ask`, a method of `Control` that any thread may call.

    It is in the log and the audit trail, and is refused where the campaign does not run. `command_help` and
    `default_reason` are of its command.
    """

    def in_service(control: ServiceBench, context: CommandContext, request: AddressedRequest) -> CampaignResponse:
        if control.runner is None:
            raise refused(context, request)
        answer = control.runner.ask(request.campaign, lambda running: ask(running, request.body.text))
        control.record(context, name, request.campaign, request.body.text)
        return answer

    def in_foreground(_: Foreground, context: CommandContext, request: AddressedRequest) -> CampaignResponse:
        """Raise Conflict: a campaign that this process could ask would hold the database."""
        raise refused(context, request)

    def refused(context: CommandContext, request: AddressedRequest) -> Exception:
        return not_running(context.store, request.campaign, f"{name} it ({request.body.reason})")

    return CampaignAct(
        name=name,
        body=ReasonRequest,
        request_type=AddressedRequest,
        summary=summary,
        description=description,
        command_line=CampaignCommand(help=command_help, defaults={"reason": default_reason}),
        in_service=in_service,
        in_foreground=in_foreground,
        is_urgent=True,
    )
