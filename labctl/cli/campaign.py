"""`labctl campaign`: plan, start, list, status."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli import schedule
from labctl.cli.error_reporting import ending_is_an_interrupt, one_clear_line
from labctl.cli.options import BenchName, Database, Json
from labctl.cli.output import console, format_number, print_json, stderr, table

if TYPE_CHECKING:
    from labctl.services.schemas.campaigns import CampaignResponse
    from labctl.services.schemas.plans import PlanResponse

app = typer.Typer(no_args_is_help=True, help="Campaigns: one run of a recipe on a bench with its units.")
app.add_typer(schedule.app, name="schedule")

Recipe = Annotated[str, typer.Argument(metavar="RECIPE", help="Recipe file, or the name of a shipped recipe.")]
Clip = Annotated[bool, typer.Option("--clip", help="Leave out points beyond the bench or a unit, and say which.")]
CampaignId = Annotated[int | None, typer.Argument(metavar="ID", help="Campaign; default: the newest.")]


@app.command("plan")
def plan(
    recipe: Recipe,
    bench: BenchName = None,
    clip: Clip = False,
    visibility: Annotated[
        bool, typer.Option("--visibility", help="Also say what the plan could and could not find, from which size on.")
    ] = False,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Say what a campaign would do and how long it takes. Nothing moves."""
    from labctl.services.planning.loading import describe_plan
    from labctl.services.simulation.walk import visibility as look

    with one_clear_line():
        answer = describe_plan(recipe, bench, clip=clip, look=look if visibility else None)
    if as_json:
        print_json(answer)
    else:
        print_plan(answer)


def print_plan(answer: PlanResponse) -> None:
    """Print a plan's figures for a person."""
    console.print(f"[bold]{answer.recipe}[/] on {answer.bench}")
    console.print(f"  {answer.datasets} data sets in {answer.steps} steps, about {hours(answer.expected_s)}")
    for left_out in answer.clipped:
        console.print(f"  left out: {left_out}", style="yellow", markup=False)
    if answer.visibility is None:
        return
    rows = table("\nwhat this plan could find", "effect", "visible share", "from size", "unit", numbers=3)
    for line in answer.visibility:
        if line.visible:
            rows.add_row(line.effect, format_number(line.share, 2), format_number(line.smallest_size, 2), line.unit)
    console.print(rows)
    hidden = table("\nand what not", "effect", "because of", "what would show it")
    for line in answer.visibility:
        if not line.visible:
            why = f"no channel {', '.join(line.needs)}" if line.why == "channel" else "the schedule"
            hidden.add_row(line.effect, why, line.experiment)
    console.print(hidden)


def hours(seconds: float) -> str:
    """Write a duration as a person says it: 41 h 52 min."""
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60:02d} min" if minutes >= 60 else f"{minutes} min"


@app.command("start")
def start(
    recipe: Recipe,
    bench: BenchName = None,
    clip: Clip = False,
    speed: Annotated[
        float | None,
        typer.Option("--speed", metavar="X", help="A simulated bench, X times as fast; default: as fast as it can."),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the simulated bench.")] = None,
    at: Annotated[
        str | None, typer.Option("--at", metavar="TIME", help="Begin then: 2026-03-28T22:00, or now: when it is free.")
    ] = None,
    cron: Annotated[
        str | None, typer.Option("--cron", metavar="LINE", help="Begin again and again: '30 22 * * FRI'.")
    ] = None,
    time_zone: Annotated[
        str | None, typer.Option("--time-zone", metavar="NAME", help="Of TIME and LINE; default: the local one.")
    ] = None,
    priority: Annotated[
        int | None, typer.Option("--priority", metavar="N", help="The highest goes first; default: 0.")
    ] = None,
    late_limit_s: Annotated[
        float | None,
        typer.Option("--late-limit-s", metavar="S", help="Later it is not begun; 0 skips a missed start."),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Run a recipe. A service that holds the database runs it on its bench; else it runs here, until it is over.

    With --at or --cron it is entered into the schedule, which only a service (`labctl serve`) carries out.
    """
    from labctl.cli.progress_bar import CampaignProgress
    from labctl.cli.terminal_operator import TerminalOperator
    from labctl.services.campaigns.execution import run_here
    from labctl.services.commands.local import service_url
    from labctl.services.planning.loading import own_text
    from labctl.services.schedule.queue import is_scheduled
    from labctl.services.schemas.campaigns import CampaignRequest, StartRequest

    with one_clear_line():
        wanted = {"at": at, "cron": cron, "time_zone": time_zone, "late_limit_s": late_limit_s, "priority": priority}
        given = {name: value for name, value in wanted.items() if value is not None}
        later = CampaignRequest.model_validate({"recipe": own_text(recipe), "clip": clip, **given})
        if is_scheduled(later):
            schedule.enter(later, bench, database, as_json=as_json, pace=speed, seed=seed)
            return
        request = StartRequest(recipe=recipe, bench=bench, clip=clip, speed=speed, seed=seed)
        if url := service_url(database):
            from labctl.services.commands.remote import HttpCommands

            answer = HttpCommands(url).start_campaign(request)
        else:
            with ending_is_an_interrupt(), CampaignProgress(quiet=as_json) as progress:
                answer = run_here(database, request, progress.update, TerminalOperator().answer_prompts, _say)
    print_end(answer, as_json=as_json)


def _say(text: str) -> None:
    """Print what is worth knowing beside the answer."""
    stderr.print(f"labctl: {text}", markup=False)


def print_end(answer: CampaignResponse, *, as_json: bool) -> None:
    """Print how a campaign ended; exit 1 when that is not as it was meant."""
    print_json(answer) if as_json else print_campaign(answer)
    if answer.state in {"failed", "aborted", "interrupted"}:
        raise typer.Exit(1)


def print_campaign(answer: CampaignResponse) -> None:
    """Print where a campaign is."""
    console.print(f"campaign {answer.id} ({answer.recipe} on {answer.bench}): [bold]{answer.state}[/]", end="")
    console.print(f" – {answer.reason}" if answer.reason else "", markup=False)
    console.print(
        f"  step {answer.step or '–'} of {answer.steps}  {answer.step_text}  {100 * answer.progress:.1f} %",
        markup=False,
    )
    if answer.expected_end and answer.state in {"running", "paused", "waiting"}:
        console.print(f"  expected end {answer.expected_end:%Y-%m-%d %H:%M} UTC")
    if answer.chamber_c is not None:
        console.print(
            f"  chamber {format_number(answer.chamber_c)} deg C, gyro {format_number(answer.gyro_c)} deg C, "
            f"table {format_number(answer.rate_dps)} deg/s"
        )
    if answer.prompt is not None:
        console.print(f"  question {answer.prompt.id}: {answer.prompt.text}", style="yellow", markup=False)
    if answer.wish is not None:
        console.print(f"  {answer.wish} was asked for and follows", style="yellow", markup=False)
    for device, state in answer.links.items():
        console.print(f"  {device}: link {state}", style="red", markup=False)
    for unit, why in answer.dropped.items():
        console.print(f"  {unit} takes no further part: {why}", style="red", markup=False)
    if answer.last_error:
        console.print(f"  last fault: {answer.last_error}", style="red", markup=False)
    for serial, recording in answer.recordings.items():
        console.print(f"  recording {recording}: {serial}", markup=False)


@app.command("list")
def list_(as_json: Json = False, database: Database = None) -> None:
    """List all campaigns, newest first."""
    from labctl.services.campaigns.status import list_campaigns
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answers = list_campaigns(store)
    if as_json:
        print_json(answers)
        return
    rows = table("", "id", "recipe", "bench", "state", "started", "progress", numbers=1)
    for answer in answers:
        started = f"{answer.started_at:%Y-%m-%d %H:%M}" if answer.started_at else "–"
        rows.add_row(
            str(answer.id), answer.recipe, answer.bench, answer.state, started, f"{100 * answer.progress:.0f} %"
        )
    console.print(rows)


@app.command("status")
def status(campaign: CampaignId = None, as_json: Json = False, database: Database = None) -> None:
    """Say where a campaign is: live from a running service, else what the database tells."""
    with one_clear_line():
        answer = look(database, campaign)
    print_json(answer) if as_json else print_campaign(answer)


def look(database: str | None, campaign: int | None) -> CampaignResponse:
    """Return where a campaign is; without a number the newest."""
    from labctl.services.campaigns.status import campaign_status
    from labctl.services.commands.local import service_url
    from labctl.services.commands.open import open_readonly

    with open_readonly(database) as store:
        answer = campaign_status(store, campaign)
    if url := service_url(database):
        from labctl.services.commands.remote import HttpCommands

        return HttpCommands(url).campaign(answer.id)
    return answer
