"""`labctl bench`: does every instrument answer?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, WireLog
from labctl.cli.output import console, print_json, stderr

app = typer.Typer(no_args_is_help=True, help="The benches: tables, chambers and gyros.")


def is_terminal() -> bool:
    """Return whether a person can be asked."""
    return sys.stdin.isatty()


@app.command("check")
def check(
    bench: Annotated[str, typer.Argument(metavar="FILE", help="Bench file, or the name of a shipped bench.")],
    wire_log: WireLog = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Connect to every instrument of a bench and list what was found, each fault with what to do. Nothing moves.

    What the bench file states of its standards is compared with the register of the database, where both are there; a
    bench without standards needs no database.
    """
    from labctl.cli.printing.benches import print_check
    from labctl.services.benches.check import check_bench
    from labctl.services.planning.loading import load_bench
    from labctl.services.read_access import open_existing
    from labctl.services.standards.agreement import compared

    with one_clear_line():
        answer = compared(check_bench(bench, wire_log), load_bench(bench), lambda: open_existing(database))
    if as_json:
        print_json(answer)
    else:
        print_check(answer)
    if not answer.ok:
        raise typer.Exit(1)


@app.command("ports")
def ports(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001  every command takes it
    """List the serial ports of this computer: name for a bench file, USB adapter, and what prevents its use."""
    from labctl.services.benches.serial_ports import list_ports

    port_listing = list_ports()
    if as_json:
        print_json(port_listing)
        return
    for port in port_listing:
        adapter = f"USB adapter {port.adapter or 'without a serial number'} ({port.product})" if port.product else ""
        text = [f"now {port.device}" if port.device != port.path else "", adapter, port.trouble]
        console.print(f"{port.path}  {'; '.join(filter(None, text))}", soft_wrap=True)
    if not port_listing:
        console.print("this computer has no serial port: plug in the USB adapters")


Name = Annotated[
    str, typer.Option("--name", help="Name of the bench; default: the name of the file without its suffix.")
]


@app.command("new")
def new(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Bench file to write.")],
    name: Name = "",
    latitude_deg: Annotated[
        float | None,
        typer.Option(
            "--latitude", metavar="DEG", help="Latitude of the bench, deg; the Earth's rate is computed from it."
        ),
    ] = None,
    port: Annotated[
        list[str] | None,
        typer.Option(
            "--port",
            metavar="PATH",
            help="Serial port to search; may be repeated; default: all ports of this computer.",
        ),
    ] = None,
    host: Annotated[
        list[str] | None,
        typer.Option("--host", metavar="HOST[:PORT]", help="Network name of a Modbus TCP instrument; may be repeated."),
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="SECTION.KEY=VALUE",
            help="Setting of the bench file, such as table.max_rate_dps=100 or stim300.serial=A1.",
        ),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Ask no questions; a missing setting is then an error.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Write a bench file: find which instrument answers on each port, ask for the rest. Nothing moves or is set."""
    from labctl.answers.benches import NewBenchRequest
    from labctl.cli.bench_dialogue import asking, not_asking, print_search
    from labctl.services.benches.new_bench import new_bench, parse_setting

    asks = asking if not yes and not as_json and is_terminal() else not_asking
    with one_clear_line():
        settings = dict(map(parse_setting, setting or []))
        options = {"name": name or file.stem, "latitude_deg": latitude_deg, "ports": port or [], "hosts": host or []}
        request = NewBenchRequest.model_validate({**options, "settings": settings})
        answer = new_bench(file, request, asks, lambda line: None if as_json else print_search(line), force=force)
    if as_json:
        print_json(answer)
    else:
        console.print(f"{answer.file} is written; check it: labctl bench check {answer.file}")


@app.command("wiggle")
def wiggle(
    bench: Annotated[str, typer.Argument(metavar="FILE", help="Bench file, or the name of a shipped bench.")],
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Turn one unit after the other by hand when asked, and learn on which port each is; exit 1 where a port is
    another unit's.
    """
    from labctl.services.benches.wiggle import wiggle as wiggle_test

    say = stderr if as_json else console
    with one_clear_line():
        answer = wiggle_test(bench, lambda line: say.print(line, soft_wrap=True))
    if as_json:
        print_json(answer)
    else:
        for unit in answer.units:
            mark = Text("right", "green") if unit.ok else Text("wrong", "red")
            console.print(mark, f"  {unit.unit:8} ", sep="", end="")
            console.print(f"{unit.serial}: {unit.text}", soft_wrap=True)
    if not answer.ok:
        raise typer.Exit(1)


@app.command("status")
def status(as_json: Json = False, database: Database = None) -> None:
    """List the benches that were used or are driven: their last safe state, what a lost process left, and which service
    drives each; exit 1 where a bench is not confirmed safe or its service is gone.
    """
    from labctl.cli.printing.benches import print_status
    from labctl.services.campaigns.bench_status import bench_statuses
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        benches = bench_statuses(store)
    if as_json:
        print_json(benches)
    else:
        for bench in benches:
            print_status(bench)
    if any(bench.unconfirmed or bench.left or (bench.driver and not bench.driver.alive) for bench in benches):
        raise typer.Exit(1)


@app.command("clear")
def clear(
    bench: Annotated[str, typer.Argument(metavar="NAME", help="Name of the bench, as `labctl bench status` shows it.")],
    by: Annotated[str, typer.Option("--by", metavar="NAME", help="Name of the person who has inspected the bench.")],
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="What was found.")] = "inspected the bench",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Record that you have inspected a bench that was not confirmed safe; campaigns may start on it again."""
    from labctl.answers.benches import ClearRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import CLEAR_BENCH
    from labctl.services.commands.requests import ToBench

    with one_clear_line():
        answer = execute(database, CLEAR_BENCH, ToBench(bench, ClearRequest(by=by, reason=reason)))
    print_json(answer) if as_json else console.print(f"{answer.name}: the safe state is confirmed")


@app.command("list")
def list_(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001
    """List the benches that ship with labctl."""
    from labctl.services.benches.check import shipped

    benches = shipped()
    if as_json:
        print_json(benches)
        return
    for bench in benches:
        console.print(f"{bench.name:18} {bench.text}")
