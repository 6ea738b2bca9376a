"""`labctl campaign`: plan, start, list, status."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from labctl.cli.campaign_acts import CampaignGroup
from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import (
    BenchName,
    CampaignId,
    Database,
    Json,
    Limit,
    Search,
    SimulatedSpeed,
    SimulatedStart,
    WireLog,
    names_in,
    pair,
    simulated_start,
)
from labctl.cli.output import console, print_json, print_part, table
from labctl.cli.printing.campaigns import print_campaign, print_plan, print_started
from labctl.probability_text import share_text

if TYPE_CHECKING:
    pass

app = typer.Typer(
    cls=CampaignGroup, no_args_is_help=True, help="Campaigns: one run of a recipe on a bench with its units."
)

Recipe = Annotated[str, typer.Argument(metavar="RECIPE", help="Recipe file, or the name of a shipped recipe.")]
Clip = Annotated[
    bool, typer.Option("--clip", help="Leave out points beyond the limits of the bench or a unit, and list them.")
]
Seed = Annotated[int | None, typer.Option("--seed", help="Seed of the simulated bench.")]
At = Annotated[
    str | None,
    typer.Option(
        "--at",
        metavar="TIME",
        help="Start later, in a running service: 2026-03-28T22:00, or `now` for as soon as the bench is free.",
    ),
]
Cron = Annotated[
    str | None,
    typer.Option(
        "--cron",
        metavar="LINE",
        help="Start repeatedly, in a running service: cron line such "
        "as '30 22 * * FRI' (minute, hour, day, month, weekday).",
    ),
]
TimeZone = Annotated[
    str | None,
    typer.Option(
        "--time-zone", metavar="NAME", help="Time zone of --at and --cron; default: the time zone of this computer."
    ),
]
Priority = Annotated[
    int | None,
    typer.Option(
        "--priority",
        metavar="N",
        help="When several starts are due, the one with the highest priority begins first; default: 0.",
    ),
]
LateLimit = Annotated[
    float | None,
    typer.Option(
        "--late-limit-s",
        metavar="S",
        help="Skip a start that is more than S seconds late; 0 skips every missed start; default: no limit on a "
        "simulated bench; on a real bench 3600, without the time behind a running campaign.",
    ),
]
ClearConfirmedBy = Annotated[
    str | None,
    typer.Option(
        "--clear-confirmed-by",
        metavar="NAME",
        help="For a real bench: NAME confirms that the chamber is clear, the table free and "
        "the limiter on. Default: labctl asks at the terminal.",
    ),
]


Hide = Annotated[
    list[str] | None,
    typer.Option(
        "--hide",
        metavar="EFFECT[=SIZE]",
        help="Hide an effect in the simulated gyros; may be repeated; SIZE is a number in the unit of the effect, or "
        "zN, such as z10, for a signal of N standard deviations of the noise on this plan.",
    ),
]
NoFit = Annotated[
    bool, typer.Option("--no-fit", help=r"Make no draft calibration, even if the recipe has a section \[fit].")
]


@app.command("plan")
def plan(
    recipe: Recipe,
    bench: BenchName = None,
    clip: Clip = False,
    visibility: Annotated[
        bool,
        typer.Option(
            "--visibility",
            help="Also list the effects that the plan can and cannot detect, with the smallest detectable size.",
        ),
    ] = False,
    unit: Annotated[
        str | None,
        typer.Option(
            "--unit",
            metavar="SERIAL",
            help="With --visibility: judge the plan as a next experiment for this unit, together with the recordings "
            "of its version.",
        ),
    ] = None,
    version: Annotated[int | None, typer.Option("--version", help="Version of --unit; default: its newest.")] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show the steps of a campaign and how long it takes, by earlier campaigns on the bench if any. Nothing moves."""
    from instruments.clock import SystemClock
    from labctl.services.benches.stop_rules import check_stop_on
    from labctl.services.criticism.planned_visibility import looking
    from labctl.services.planning.plan_answer import describe_plan
    from labctl.services.read_access import open_readable
    from labctl.services.schedule.planned_start import planned_start

    with one_clear_line():
        start = planned_start(None, None, None, SystemClock().utc())
        with open_readable(database) as store:
            seen = looking(store, unit, version) if visibility else None
            answer = describe_plan(recipe, bench, clip=clip, look=seen, start=start, store=store, check=check_stop_on)
    if as_json:
        print_json(answer)
    else:
        print_plan(answer)


Like = Annotated[
    str | None,
    typer.Option(
        "--like",
        metavar="RECIPE",
        help="Recipe file or shipped recipe whose rates, temperatures, positions and model count where no option gives "
        "others; the design is compared with it.",
    ),
]
Model = Annotated[str | None, typer.Option("--model", metavar="NAME", help="Model to fit; default: that of --like.")]
Effects = Annotated[str | None, typer.Option("--effects", metavar="A,B", help="Effects to fit beside the model.")]
GoalU = Annotated[
    float | None,
    typer.Option(
        "--u",
        metavar="DPS",
        help="U (k = 2) to reach everywhere in the range, deg/s, of each component of a corrected rate vector.",
    ),
]
Hours = Annotated[
    float | None, typer.Option("--hours", metavar="H", help="Bench hours at most; without --u: the best within.")
]
Rates = Annotated[
    str | None,
    typer.Option(
        "--rates", metavar="LOW,HIGH", help="Range of rates, deg/s; default: that of --like, or of the bench."
    ),
]
Temperatures = Annotated[
    str | None,
    typer.Option(
        "--temperatures",
        metavar="LOW,HIGH",
        help="Range of temperatures, deg C; default: that of --like, or of the bench.",
    ),
]
Prior = Annotated[
    list[str] | None,
    typer.Option(
        "--prior",
        "--serial",
        metavar="SERIAL",
        help="Unit whose newest calibration states the noise: this unit, or one of its type; may be repeated.",
    ),
]


TypePrior = Annotated[
    str | None,
    typer.Option(
        "--type-prior",
        metavar="TYPE",
        help="Count with what the calibrated units of this type say of the coefficients; the recipe's fit does so too.",
    ),
]


@app.command("design")
def design(
    out: Annotated[Path, typer.Option("--out", metavar="RECIPE.toml", help="File for the recipe.")],
    like: Like = None,
    model: Model = None,
    effects: Effects = None,
    u_dps: GoalU = None,
    hours: Hours = None,
    rates: Rates = None,
    temperatures: Temperatures = None,
    prior: Prior = None,
    type_prior: TypePrior = None,
    bench: BenchName = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Write the cheapest recipe that reaches an uncertainty on a bench, or the best within given hours.

    Nothing moves. Each choice is explained, with the next best recipes beside it. `labctl campaign start` runs the
    file.
    """
    from labctl.answers.design import DesignRequest
    from labctl.cli.printing.design import print_design
    from labctl.services.design.design import design_campaign
    from labctl.services.planning.loading import load_bench, own_text
    from labctl.services.read_access import open_readable

    with one_clear_line():
        options: dict[str, Any] = {"model": model, "u_dps": u_dps, "hours": hours, "prior": prior or []}
        options |= {"type_prior": type_prior}
        options |= {"like": None if like is None else own_text(like), "effects": names_in(effects)}
        options |= {"rates_dps": pair("--rates", rates), "temperatures_c": pair("--temperatures", temperatures)}
        request = DesignRequest.model_validate(options)
        with open_readable(database) as store:
            answer = design_campaign(store, request, None if bench is None else load_bench(bench))
        out.write_text(answer.recipe_toml, encoding="utf-8")
    print_json(answer) if as_json else print_design(answer, out)


@app.command("start")
def start(
    recipe: Recipe,
    bench: BenchName = None,
    clip: Clip = False,
    speed: SimulatedSpeed = None,
    seed: Seed = None,
    at: At = None,
    cron: Cron = None,
    time_zone: TimeZone = None,
    priority: Priority = None,
    late_limit_s: LateLimit = None,
    clear_confirmed_by: ClearConfirmedBy = None,
    hide: Hide = None,
    simulated_from: SimulatedStart = None,
    no_fit: NoFit = False,
    wire_log: WireLog = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    r"""Run a recipe. A service that uses the database runs it on its bench; without one it runs in this terminal
    until it ends.

    A recipe with \[fit] ends in a draft: a calibration that is fitted, criticised and not certified.
    With --at or --cron it is added to the schedule, which only a service (`labctl serve`) carries out. On a bench
    that is not simulated a person has to confirm first that the bench is clear, or will be at that time.
    """
    from labctl.answers.campaigns import BENCH_CHECKS, CampaignRequest
    from labctl.cli.campaign_terminal import campaign_terminal
    from labctl.services.commands.acts.start import START_CAMPAIGN
    from labctl.services.commands.open import open_commands
    from labctl.services.commands.requests import CampaignStart
    from labctl.services.planning.loading import own_text

    with one_clear_line():
        timing = {"at": at, "cron": cron, "time_zone": time_zone, "late_limit_s": late_limit_s, "priority": priority}
        options: dict[str, Any] = {name: value for name, value in timing.items() if value is not None}
        if clear_confirmed_by is not None:
            options |= {"confirmed_by": clear_confirmed_by, "checks": list(BENCH_CHECKS)}
        if hide:
            options["hide"] = hide
        if no_fit:
            options["fit"] = False
        request = CampaignRequest.model_validate({"recipe": own_text(recipe), "clip": clip, **options})
        start_at = simulated_start(simulated_from)
        order = CampaignStart(request, bench=bench, speed=speed, seed=seed, simulated_start=start_at, wire_log=wire_log)
        with open_commands(database, campaign_terminal(quiet=as_json)) as commands:
            answer = commands.execute(START_CAMPAIGN, order)
    print_started(answer, as_json=as_json)


@app.command("list")
def list_(search: Search = "", limit: Limit = None, as_json: Json = False, database: Database = None) -> None:
    """List the campaigns, newest first."""
    from labctl.services.campaigns.status import page_of_campaigns
    from labctl.services.read_access import open_readonly
    from labctl.store.paging import PageRequest

    with one_clear_line(), open_readonly(database) as store:
        page = page_of_campaigns(store, PageRequest(search, limit))
    answers = page.rows
    if as_json:
        print_json(answers)
        return
    rows = table("", "id", "recipe", "bench", "state", "started", "progress", numbers=1)
    for answer in answers:
        started = f"{answer.started_at:%Y-%m-%d %H:%M}" if answer.started_at else "–"
        rows.add_row(str(answer.id), answer.recipe, answer.bench, answer.state, started, share_text(answer.progress))
    console.print(rows)
    print_part(len(answers), page.total, "campaigns")


@app.command("status")
def status(campaign: CampaignId = None, as_json: Json = False, database: Database = None) -> None:
    """Show the status of a campaign: live from a running service, else from the database."""
    from labctl.services.commands.open import current_status

    with one_clear_line():
        answer = current_status(database, campaign)
    print_json(answer) if as_json else print_campaign(answer)
