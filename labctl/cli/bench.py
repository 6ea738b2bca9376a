"""`labctl bench`: does every instrument answer?"""

from __future__ import annotations

from typing import Annotated

import typer

from labctl.cli.errors import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json

app = typer.Typer(no_args_is_help=True, help="The benches: tables, chambers and gyros.")


@app.command("check")
def check(
    bench: Annotated[str, typer.Argument(metavar="FILE", help="Bench file, or the name of a shipped bench.")],
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Talk to every instrument of a bench and say what answered. Nothing moves."""
    from labctl.services.benches import check_bench

    with one_clear_line():
        checks = check_bench(bench)
    if as_json:
        print_json({"bench": bench, "ok": all(c.ok for c in checks), "devices": [c.model_dump() for c in checks]})
    else:
        for device in checks:
            mark = "[green]answers[/]" if device.ok else "[red]failed[/] "
            console.print(f"{mark}  {device.device:14} ", end="")
            console.print(device.text, markup=False)
    if not all(c.ok for c in checks):
        raise typer.Exit(1)


@app.command("list")
def list_(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001
    """List the benches that ship with labctl."""
    from labctl.services.benches import shipped

    benches = shipped()
    if as_json:
        print_json(benches)
        return
    for bench in benches:
        console.print(f"{bench['name']:18} {bench['text']}", markup=False)
