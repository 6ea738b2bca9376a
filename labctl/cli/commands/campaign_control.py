"""`labctl campaign` watch, abort, draft: a campaign that runs, or has ended.

`labctl.cli.campaign_acts` makes the command of an act from its declaration. That of an abort is written by hand: it
stops the bench before it loads the declarations, and answers how the campaign is once the bench is safe.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.campaign_acts import Id, Reason
from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import CampaignId, Database, Json
from labctl.cli.output import console, print_json, stderr
from labctl.cli.printing.campaigns import print_campaign, print_drafts
from labctl.cli.turn_text import turn_text

if TYPE_CHECKING:
    from labctl.answers.campaigns import CampaignResponse

#: How long an abort is followed until the bench is safe, and how often it is read, s.
SAFE_WITHIN_S, POLL_INTERVAL_S = 120.0, 0.2


def watch(campaign: CampaignId = None, as_json: Json = False, database: Database = None) -> None:
    """Follow a campaign until it ends: live from a running service, else from the database."""
    from instruments.clock import SystemClock
    from labctl.cli.progress_bar import CampaignProgress
    from labctl.services.commands.open import current_status

    clock, asked_prompt, fault, turn_shown = SystemClock(), "", "", ""
    with one_clear_line(), CampaignProgress(quiet=as_json) as progress:
        while True:
            answer = current_status(database, campaign)
            progress.update(answer)
            if not as_json and answer.prompt is not None and answer.prompt.id != asked_prompt:
                asked_prompt = answer.prompt.id
                console.print(f"question {asked_prompt}: {answer.prompt.text}", style="yellow")
            if not as_json and (text := turn_text(answer)) and text != turn_shown:
                turn_shown = text
                console.print(text)
            if not as_json and answer.last_error and answer.last_error != fault:
                fault = answer.last_error
                console.print(f"fault: {fault}", style="red")
            if not answer.active:
                break
            clock.sleep(1.0)
    print_json(answer) if as_json else print_campaign(answer)


def abort(
    campaign: Id,
    reason: Reason = "aborted from the command line",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """End a running campaign now, in the safe state. The data measured so far are stored."""
    from labctl.errors import BenchSilent, NotRecorded, StoreError
    from labctl.services.campaigns.stop_first import stop_first

    with one_clear_line():
        stopped = stop_first(database, campaign, reason, say=lambda text: stderr.print(f"labctl: {text}"))
        try:
            answer = _at_its_end(database, _recorded(database, campaign, reason, stopped is not None))
        except (StoreError, BenchSilent) as error:
            if stopped is None or not stopped.stands:
                raise
            raise NotRecorded(
                f"{stopped.text}; that is not recorded yet ({error}); start the service, which records it"
            ) from error
    print_json(answer) if as_json else print_campaign(answer)
    if stopped is not None and not stopped.stands:
        raise typer.Exit(1)


def _recorded(database: str | None, campaign: int, reason: str, was_stopped: bool) -> CampaignResponse:
    """Have an abort recorded; where the campaign has ended by the stop already, its own process has recorded it."""
    from labctl.answers.campaigns import ReasonRequest
    from labctl.errors import Conflict
    from labctl.service_connection import ServiceRefused
    from labctl.services.commands.acts.abort import ABORT_CAMPAIGN
    from labctl.services.commands.open import current_status, execute
    from labctl.services.commands.requests import ToCampaign

    try:
        return execute(database, ABORT_CAMPAIGN, ToCampaign(campaign, ReasonRequest(reason=reason)))
    except (Conflict, ServiceRefused) as error:
        if not was_stopped or error.slug != Conflict.slug:
            raise
        return current_status(database, campaign)


def _at_its_end(database: str | None, answer: CampaignResponse) -> CampaignResponse:
    """Return where an aborted campaign is once its bench is safe, or after `SAFE_WITHIN_S`."""
    from instruments.clock import SystemClock
    from labctl.services.commands.open import current_status

    clock = SystemClock()
    until_s = clock.now_s() + SAFE_WITHIN_S
    while not answer.ended and clock.now_s() < until_s:
        clock.sleep(POLL_INTERVAL_S)
        answer = current_status(database, answer.id)
    return answer


def draft(
    campaign: CampaignId = None,
    again: Annotated[bool, typer.Option("--again", help="Also try again the drafts that failed before.")] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Make the drafts of a campaign that is done, where they are still due. A running service does it by itself."""
    from labctl.answers.drafts import DraftsRequest
    from labctl.services.commands.open import current_status, execute
    from labctl.services.commands.registry import MAKE_DRAFTS
    from labctl.services.commands.requests import ToCampaign

    with one_clear_line():
        campaign_number = campaign if campaign is not None else current_status(database, None).id
        answer = execute(database, MAKE_DRAFTS, ToCampaign(campaign_number, DraftsRequest(again=again)))
    if as_json:
        print_json(answer)
    elif answer.drafts:
        print_drafts(answer.drafts)
    else:
        console.print(f"campaign {answer.campaign} has no draft: its recipe has no [fit]")
    if any(each.state == "failed" for each in answer.drafts):
        raise typer.Exit(1)


def add_to(app: typer.Typer) -> None:
    """Put these commands beside the others of `labctl campaign`."""
    for command in (watch, abort, draft):
        app.command(command.__name__)(command)
