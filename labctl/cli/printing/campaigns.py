"""Campaigns, plans and entries of the schedule as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer
from rich.text import Text

from labctl.cli.output import console, format_number, print_heading, print_json, table
from labctl.cli.turn_text import turn_text
from labctl.shown_unit import shown_unit, size_text
from procedures.contracts.campaign_state import STOPPED_EARLY, UNDER_WAY

if TYPE_CHECKING:
    from labctl.answers.campaigns import CampaignResponse
    from labctl.answers.drafts import DraftResponse
    from labctl.answers.plans import AttendanceResponse, MisalignmentOutlook, PlanResponse, Visibility
    from labctl.answers.schedule import ScheduledResponse


def _print_sources(learned: Sequence[str], guessed: Sequence[str]) -> None:
    """Print where the figures of the expected time are from, other than the bench file."""
    for known in learned:
        console.print(f"  {known}", soft_wrap=True, markup=False)
    for guess in guessed:
        console.print(f"  a guess: {guess}", soft_wrap=True, markup=False)


def print_plan(answer: PlanResponse) -> None:
    """Print a plan's figures for a person."""
    print_heading(answer.recipe, f" on {answer.bench}")
    console.print(f"  {answer.datasets} data sets in {answer.steps} steps, about {hours(answer.expected_s)}")
    _print_sources(answer.learned, answer.guessed)
    if answer.verification_datasets:
        share = 100.0 * answer.verification_s / max(answer.expected_s, 1e-9)
        console.print(
            f"  {answer.verification_datasets} of them verify and are never fitted, about "
            f"{hours(answer.verification_s)} ({share:.0f} %)"
        )
    if (angles := answer.misalignment) is not None:
        _print_mountings(angles)
    for left_out in answer.clipped:
        console.print(f"  left out: {left_out}", style="yellow")
    if answer.attendance is not None:
        console.print(f"  begun now it {answer.attendance.text}")
        _print_warning(answer.attendance)
    if answer.visibility is None:
        return
    rows = table("\neffects that this plan could detect", "effect", "visible share", "from size", "unit", numbers=3)
    for line in answer.visibility:
        if line.visible:
            shown = shown_unit(line.unit, line.effect)
            smallest = format_number(shown.scaled(line.smallest_size), 2)
            name = line.effect if line.order is None else f"{line.effect}, order {line.order}"
            rows.add_row(name, format_number(line.share, 2), smallest, shown.unit)
    console.print(rows)
    hidden = table("\nand what not", "effect", "because of", "experiment that would detect it")
    for line in answer.visibility:
        if not line.visible:
            hidden.add_row(line.effect, _hidden_by(line), "" if line.in_model else line.experiment)
    console.print(hidden)


def _hidden_by(line: Visibility) -> str:
    """Return why a plan cannot detect an effect: channel, schedule, technology, or how large it would have to be."""
    if line.in_model:
        return "nothing: the model has it, and a fit estimates it"
    if line.why == "channel":
        return f"no channel {', '.join(line.needs)}"
    if line.why == "technology":
        return "the technology of the gyro, which does not have it"
    if line.why == "size":
        shown = shown_unit(line.unit, line.effect)
        return f"its size: {format_number(shown.scaled(line.smallest_size), 2)} {shown.unit} would be needed"
    return "the schedule"


def _print_warning(attendance: AttendanceResponse) -> None:
    if attendance.warning:
        console.print(f"  at night: {attendance.warning}", style="yellow", soft_wrap=True)


def hours(seconds: float) -> str:
    """Write a duration as a person says it: 41 h 52 min."""
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60:02d} min" if minutes >= 60 else f"{minutes} min"


def print_end(answer: CampaignResponse, *, as_json: bool) -> None:
    """Print how a campaign ended; exit 1 when it did not end as planned."""
    print_json(answer) if as_json else print_campaign(answer)
    if answer.state in STOPPED_EARLY:
        raise typer.Exit(1)


def print_started(answer: CampaignResponse | ScheduledResponse, *, as_json: bool) -> None:
    """Print how a campaign ended, or the entry of the schedule that it became."""
    from labctl.answers.schedule import ScheduledResponse

    if not isinstance(answer, ScheduledResponse):
        print_end(answer, as_json=as_json)
    elif as_json:
        print_json(answer)
    else:
        print_start(answer)


def print_campaign(answer: CampaignResponse) -> None:
    """Print where a campaign is."""
    console.print(
        f"campaign {answer.id} ({answer.recipe} on {answer.bench}): ", Text(answer.state, "bold"), sep="", end=""
    )
    console.print(f" – {answer.reason}" if answer.reason else "")
    console.print(
        f"  step {answer.step or '–'} of {answer.steps}  {answer.step_text}  {100 * answer.progress:.1f} %",
    )
    if answer.expected_end and answer.state in UNDER_WAY:
        clock = "simulated time" if answer.simulated_time else "UTC"
        console.print(f"  expected end {answer.expected_end:%Y-%m-%d %H:%M} {clock}")
    if answer.chamber_c is not None:
        console.print(
            f"  chamber {format_number(answer.chamber_c)} deg C, gyro {format_number(answer.gyro_c)} deg C, "
            f"table {format_number(answer.rate_dps)} deg/s"
        )
    for unit in answer.target.units if answer.target is not None else ():
        console.print(f"  {unit.text}", soft_wrap=True)
    _print_instruments(answer)
    _print_question(answer)
    _print_troubles(answer)
    _print_advice(answer)
    for serial, recording in answer.recordings.items():
        console.print(f"  recording {recording}: {serial}")
    print_drafts(answer.drafts)
    for device, identity in answer.reported.items():
        identity_text = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in identity.items())
        console.print(f"  {device} says: {identity_text}", soft_wrap=True)


def _print_troubles(answer: CampaignResponse) -> None:
    """Print what is requested and not done yet, and what went wrong."""
    if answer.wish is not None:
        console.print(f"  requested and still to be carried out: {answer.wish}", style="yellow")
    for unit, reason in answer.dropped.items():
        console.print(f"  {unit} is excluded from the rest of the campaign: {reason}", style="red")
    _print_hindrances(answer)
    if answer.last_error:
        console.print(f"  last fault: {answer.last_error}", style="red")
    if answer.unrecorded:
        console.print(f"  {answer.unrecorded}", style="red")


def _print_hindrances(answer: CampaignResponse) -> None:
    """Print what held the campaign up that is no fault of an instrument."""
    if answer.repeated:
        console.print(f"  {answer.repeated} data sets were taken again", style="yellow")
    if answer.stalled_s:
        console.print(f"  this computer did not run labctl for {answer.stalled_s:.1f} s", style="yellow")


def print_drafts(drafts: Sequence[DraftResponse]) -> None:
    """Print what each draft of a campaign is, or why there is none."""
    for draft in drafts:
        if draft.state == "failed":
            console.print(f"  {draft.reason}", style="red", soft_wrap=True)
        elif draft.report is not None:
            is_certifiable = draft.report.within_limits is not False and not draft.report.objections
            console.print(f"  {draft.report.text}", style="" if is_certifiable else "yellow", soft_wrap=True)
        else:
            text = f"  draft of {draft.serial}: not made yet; a service makes it, or `labctl campaign draft "
            console.print(f"{text}{draft.campaign}`", soft_wrap=True)


def _print_instruments(answer: CampaignResponse) -> None:
    """Print what reference instruments read, and links that are not well."""
    for column, value in answer.references.items():
        console.print(f"  {column} {format_number(value)} (reference instrument)")
    for device, state in answer.links.items():
        console.print(f"  {device}: link {state}", style="red")


def _print_question(answer: CampaignResponse) -> None:
    """Print what a person is asked, and how far a turn by hand has come."""
    if text := turn_text(answer):
        console.print(f"  {text}")
    if answer.prompt is not None:
        console.print(f"  question {answer.prompt.id}: {answer.prompt.text}", style="yellow")


def _print_advice(answer: CampaignResponse) -> None:
    """Print a failure in words, and whether the campaign may be resumed."""
    if answer.advice is not None:
        console.print(f"  what happened: {answer.advice.happened}", soft_wrap=True)
        console.print(f"  what labctl did: {answer.advice.done}", soft_wrap=True)
        console.print(f"  what to do next: {answer.advice.next}", soft_wrap=True)
    if answer.state in STOPPED_EARLY and answer.resume_reason:
        word = "resume only after you have checked the points above" if answer.resumable else "not resumable"
        console.print(f"  {word}: {answer.resume_reason}", style="yellow", soft_wrap=True)


def print_start(answer: ScheduledResponse) -> None:
    """Print one entry of the schedule."""
    console.print(f"start {answer.id} ({answer.recipe} on {answer.bench}): ", Text(answer.state, "bold"), sep="")
    if answer.due_at is not None:
        again = f", repeated by cron line {answer.cron!r}" if answer.cron else ""
        console.print(f"  begins {answer.due_at:%Y-%m-%d %H:%M %z} ({answer.time_zone}){again}")
    if answer.confirmed_by:
        console.print(f"  {answer.confirmed_by} confirmed that the bench will be clear")
    if answer.attendance is not None:
        console.print(f"  {answer.attendance.text}", soft_wrap=True)
        _print_warning(answer.attendance)
    for event in answer.history:
        console.print(f"  due {event.due_at:%Y-%m-%d %H:%M %z}: {event.outcome}: {event.message}")
    if answer.note:
        console.print(f"  {answer.note}", style="yellow")


def _print_mountings(angles: MisalignmentOutlook) -> None:
    """Print how well a misalignment can be known, and what further mountings are worth."""
    at_best = size_text(angles.expanded, "1", "misalignment")
    console.print(f"  misalignment: U {at_best} at best, by fixture and table", soft_wrap=True)
    for more in angles.further:
        u = size_text(more.expanded, "1", "misalignment")
        console.print(
            f"    {u} with {more.turned}: mountings: {more.mountings} more, time: "
            f"{hours(more.more_s)} more; the recipe then has",
            soft_wrap=True,
        )  # fmt: skip
        for line in more.recipe_toml.splitlines():
            console.print(f"      {line}", soft_wrap=True, markup=False)
    if angles.not_stated:
        console.print(f"    not in U, since the bench does not state it: {', '.join(angles.not_stated)}")
