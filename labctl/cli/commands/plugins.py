"""`labctl plugins` and `labctl driver`: what is installed beside labctl, and whether it can be used."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table

TriedWireLog = Annotated[
    Path | None,
    typer.Option(
        "--wire-log",
        metavar="FILE",
        help="With a FILE and its instrument: file for every byte between labctl and the instrument, compressed; "
        "default: one in the folder for temporary files, kept if a request failed.",
    ),
]

driver_app = typer.Typer(no_args_is_help=True, help="The drivers of tables, chambers and gyros.")


def plugins(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001  every command takes it
    """List drivers, simulators, effects, exports and importers with their packages; exit 1 where one cannot be used."""
    from labctl.services.plugins import list_plugins

    with one_clear_line():
        listing = list_plugins()
    if as_json:
        print_json(listing)
    else:
        rows = table("plug-ins", "group", "name", "package", "state")
        for each in listing:
            state = "cannot be used" if each.problem else "ready"
            rows.add_row(each.group, each.name, f"{each.distribution} {each.version}", state)
        console.print(rows)
        for line in dict.fromkeys(each.problem for each in listing if each.problem):
            stderr.print(line, soft_wrap=True)
    if any(each.problem for each in listing):
        raise typer.Exit(1)


@driver_app.command("test")
def driver_checks(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            help="Name of the driver, as bench files give it; or the description of an instrument, a .toml file.",
        ),
    ],
    bench: Annotated[
        str | None,
        typer.Option(
            "--bench",
            metavar="FILE",
            help="Bench file of a simulated bench that uses the driver; "
            "default: the bench of the driver's package, else a shipped bench.",
        ),
    ] = None,
    port: Annotated[
        str | None, typer.Option("--port", metavar="PORT", help="With a FILE: serial port of the instrument.")
    ] = None,
    host: Annotated[
        str | None, typer.Option("--host", metavar="HOST:PORT", help="With a FILE: network address of the instrument.")
    ] = None,
    move: Annotated[
        bool,
        typer.Option(
            "--move",
            help="With a FILE: also send its commands. The table homes, turns both ways and is stopped; the set point "
            "of the chamber moves by one step and back.",
        ),
    ] = False,
    wire_log: TriedWireLog = None,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Try a driver on its simulator, or a description on its instrument; exit 1 if a requirement is not met."""
    if name.endswith(".toml"):
        if bench is not None:
            raise typer.BadParameter("a description is tried on --port or --host, not on a bench file; leave it out")
        _try_description(name, port, host, wire_log, move=move, as_json=as_json)
    elif port is not None or host is not None or move or wire_log is not None:
        raise typer.BadParameter(
            "a driver of a package is tried on its simulator; --port, --host, --move and --wire-log belong to the "
            "description of an instrument, a .toml file; for a wire log of a driver use `labctl bench check FILE "
            "--wire-log FILE`"
        )
    else:
        _try_driver(name, bench, as_json=as_json)


def _try_description(
    file: str, port: str | None, host: str | None, wire_log: Path | None, *, move: bool, as_json: bool
) -> None:
    from labctl.answers.admin import DescribedCheckResponse
    from labctl.services.benches.described_instruments import check_description

    sends = port is not None or host is not None

    def show(each: DescribedCheckResponse) -> None:
        if not as_json:
            mark = Text("fails  ", "red") if each.problem else Text("does   " if sends else "sends  ", "green")
            console.print(mark, end="")
            console.print(f"{each.what:18} {each.problem or each.answer}", soft_wrap=True, markup=False)

    with one_clear_line():
        answer = check_description(file, port, host, show, move=move, wire_log=wire_log)
    if as_json:
        print_json(answer)
    elif not sends:
        console.print(f"{answer.name}, a {answer.kind}: the description is valid; give --port or --host to try it")
    else:
        failed = sum(1 for check in answer.checks if check.problem)
        result_text = f"{failed} of {len(answer.checks)} failed" if failed else f"all {len(answer.checks)} passed"
        move_text = "" if move or answer.kind == "reference" else "; its commands were not tried (--move)"
        console.print(f"{answer.name}, a {answer.kind} at {answer.address}: {result_text}{move_text}", soft_wrap=True)
        if failed and answer.wire_log is not None:
            text = f"every byte is in {answer.wire_log}: add this file to a report of a fault (zcat shows it)"
            console.print(text, soft_wrap=True, markup=False, highlight=False)
    if not answer.ok:
        raise typer.Exit(1)


def _try_driver(name: str, bench: str | None, *, as_json: bool) -> None:
    from labctl.answers.admin import DriverCheckResponse
    from labctl.services.plugins import check_driver

    def show(each: DriverCheckResponse) -> None:
        if not as_json:
            console.print(Text("fails  ", "red") if each.problem else Text("does   ", "green"), end="")
            console.print(f"{each.check}{': ' if each.problem else ''}{each.problem}", soft_wrap=True)

    with one_clear_line():
        answer = check_driver(name, bench, show)
    if as_json:
        print_json(answer)
    else:
        failed = sum(1 for check in answer.checks if check.problem)
        result_text = (
            f"{failed} of {len(answer.checks)} checks failed" if failed else f"all {len(answer.checks)} checks passed"
        )
        console.print(f"{name} of {answer.distribution} {answer.version}: {result_text}")
        if failed:
            console.print(
                "this was its simulator; `labctl bench check FILE --wire-log FILE` records every byte of an instrument",
                soft_wrap=True,
            )
    if not answer.ok:
        raise typer.Exit(1)
