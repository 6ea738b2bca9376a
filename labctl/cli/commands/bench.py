"""`labctl bench`: does every instrument answer?"""

from __future__ import annotations

from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json

app = typer.Typer(no_args_is_help=True, help="The benches: tables, chambers and gyros.")


@app.command("check")
def check(
    bench: Annotated[str, typer.Argument(metavar="FILE", help="Bench file, or the name of a shipped bench.")],
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Connect to every instrument of a bench and list the answers. Nothing moves."""
    from labctl.services.benches.check import check_bench

    with one_clear_line():
        answer = check_bench(bench)
    if as_json:
        print_json(answer)
    else:
        for device in answer.devices:
            mark = "[green]answers[/]" if device.ok else "[red]failed[/] "
            console.print(f"{mark}  {device.device:14} ", end="")
            console.print(f"{device.text}  [{device.driver} of {device.distribution} {device.version}]", markup=False)
    if not answer.ok:
        raise typer.Exit(1)


@app.command("status")
def status(as_json: Json = False, database: Database = None) -> None:
    """List the benches that were not confirmed safe when their last campaign ended or its process was lost."""
    from labctl.services.campaigns.bench_status import bench_statuses
    from labctl.services.commands.open import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        benches = bench_statuses(store)
    if as_json:
        print_json(benches)
    else:
        for bench in benches:
            said = [bench.unconfirmed, *(f"not made safe; campaigns left there: {left}" for left in bench.left)]
            if bench.attempts:
                said.insert(1, f"the safe state was tried again {bench.attempts} times, last at {bench.attempted_at}")
            if bench.confirmed_at:
                said.insert(
                    2,
                    f"labctl confirmed it at {bench.confirmed_at}; a person has still to inspect the bench, then "
                    "`labctl bench clear`",
                )
            for line in filter(None, said if any(said) else ["the safe state is confirmed"]):
                console.print(f"{bench.name:18} {line}", markup=False, soft_wrap=True)
    if any(bench.unconfirmed or bench.left for bench in benches):
        raise typer.Exit(1)


@app.command("clear")
def clear(
    bench: Annotated[str, typer.Argument(metavar="NAME", help="Name of the bench, as `labctl bench status` shows it.")],
    by: Annotated[str, typer.Option("--by", metavar="NAME", help="Who has inspected it.")],
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="What was found.")] = "inspected the bench",
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Record that you have inspected a bench that was not confirmed safe; campaigns may start on it again."""
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import CLEAR_BENCH
    from labctl.services.commands.requests import ToBench
    from labctl.services.schemas.benches import ClearRequest

    with one_clear_line():
        answer = execute(database, CLEAR_BENCH, ToBench(bench, ClearRequest(by=by, reason=reason)))
    print_json(answer) if as_json else console.print(f"{answer.name}: the safe state is confirmed", markup=False)


@app.command("list")
def list_(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001
    """List the benches that ship with labctl."""
    from labctl.services.benches.check import shipped

    benches = shipped()
    if as_json:
        print_json(benches)
        return
    for bench in benches:
        console.print(f"{bench.name:18} {bench.text}", markup=False)
