"""`labctl units` and `trend`: which versions are in force, and a unit over the years."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Limit, Search, Serial
from labctl.cli.output import console, format_number, print_heading, print_json, print_part, table

if TYPE_CHECKING:
    from labctl.answers.units import AppliedVersion, TrendResponse, UnitResponse


def units(
    due_within: Annotated[
        str | None,
        typer.Option("--due-within", metavar="SPAN", help="Only units that are due within 30d, 12h, 2w, or overdue."),
    ] = None,
    calibration: Annotated[
        str | None,
        typer.Option(
            "--calibration",
            metavar="STATE",
            help="Only units with a version in force (in_force), with one that is overdue, or with none (none).",
        ),
    ] = None,
    verdict: Annotated[
        str | None,
        typer.Option(
            "--verdict",
            metavar="VERDICT",
            help="Only units whose version in force was certified with this verdict, such as adequate.",
        ),
    ] = None,
    batch: Annotated[str, typer.Option("--batch", metavar="BATCH", help="Only units of this batch.")] = "",
    search: Search = "",
    limit: Limit = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """List the units, the version in force of each, and when it is due; with --due-within the earliest date first."""
    from instruments.clock import SystemClock
    from labctl.services.calibrations.due import span
    from labctl.services.read_access import open_readonly
    from labctl.services.units import list_units
    from labctl.store.paging import PageRequest

    with one_clear_line():
        within = None if due_within is None else span(due_within)
        now = SystemClock().utc()
        with open_readonly(database) as store:
            page = list_units(store, now, PageRequest(search, limit), within, calibration, verdict, batch)
    rows = page.rows
    if as_json:
        print_json(rows)
        return
    if not rows:
        chosen = due_within or calibration or verdict or batch or search
        nothing = "no such unit is there" if chosen else "no unit has been measured or imported yet"
        console.print("no unit is due" if due_within else nothing)
        return
    _print_units(rows, page.total)


def _print_units(units: list[UnitResponse], total: int) -> None:
    """Print what the page of units shows."""
    heads = ("unit", "type", "batch", "recordings", "versions", "error / floor", "in force", "certified as", "due")
    rows = table("", *heads)
    for each in units:
        in_force = each.certified_version is not None
        due = "–" if each.due is None else f"{each.due:%Y-%m-%d}"
        rows.add_row(
            each.serial, each.model or "–", each.batch or "–", str(len(each.recordings)), str(len(each.calibrations)),
            format_number(_newest_error(each)), f"version {each.certified_version}" if in_force else "none",
            (each.certified_verdict or "none") if in_force else "–",
            Text(f"{due}, overdue", "bold red") if each.overdue else due,
        )  # fmt: skip
    console.print(rows)
    print_part(len(units), total, "units")


def _newest_error(unit: UnitResponse) -> float | None:
    """Return the error over the noise floor of the newest version that has one."""
    return next((ratio for ratio in reversed(unit.newest_errors.over_floor) if ratio is not None), None)


def trend(
    serial: Serial,
    version: Annotated[
        int | None,
        typer.Option(
            "--version",
            metavar="N",
            help="Version that is compared with all recordings of the unit; default: the first.",
        ),
    ] = None,
    limit_dps: Annotated[
        float | None,
        typer.Option(
            "--limit-dps",
            metavar="X",
            help="Largest acceptable bias after correction, deg/s; default: twice the error stated in the calibration.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show a unit over the years: as found, as left, drift per year, and when its bias leaves a limit."""
    from labctl.services.criticism.trend import trend_unit
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = trend_unit(store, serial, version, limit_dps)
    if as_json:
        print_json(answer)
    else:
        _print(answer)


def _print(answer: TrendResponse) -> None:
    print_heading(answer.serial, f", version {answer.version} compared with every recording, deg/s RMS")
    rows = table("", "recording", "date", "as found", "as left", f"version {answer.version}", numbers=3)
    for point in answer.points:
        rows.add_row(
            str(point.recording), f"{point.at:%Y-%m-%d}", _said(point.as_found), _said(point.as_left),
            format_number(point.rms_dps),
        )  # fmt: skip
    console.print(rows)
    for line in answer.text:
        console.print(line, soft_wrap=True)


def _said(applied: AppliedVersion | None) -> str:
    return "-" if applied is None else f"{format_number(applied.rms_dps)} (version {applied.version})"
