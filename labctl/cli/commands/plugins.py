"""`labctl plugins` and `labctl driver`: what is installed beside labctl, and whether it can be used."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.text import Text

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table

driver_app = typer.Typer(no_args_is_help=True, help="The drivers of tables, chambers and gyros.")


def plugins(as_json: Json = False, database: Database = None) -> None:  # noqa: ARG001  every command takes it
    """List drivers, simulators, effects, exports and importers with their packages; exit 1 where one cannot be used."""
    from labctl.services.plugins import list_plugins

    with one_clear_line():
        found = list_plugins()
    if as_json:
        print_json(found)
    else:
        rows = table("plug-ins", "group", "name", "package", "state")
        for each in found:
            state = "cannot be used" if each.problem else "ready"
            rows.add_row(each.group, each.name, f"{each.distribution} {each.version}", state)
        console.print(rows)
        for line in dict.fromkeys(each.problem for each in found if each.problem):
            stderr.print(line, soft_wrap=True)
    if any(each.problem for each in found):
        raise typer.Exit(1)


@driver_app.command("test")
def driver_checks(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the driver, as bench files give it.")],
    bench: Annotated[
        str | None,
        typer.Option(
            "--bench",
            metavar="FILE",
            help="Bench file of a simulated bench that uses the driver; "
            "default: the bench of the driver's package, else a shipped bench.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,  # noqa: ARG001  every command takes it
) -> None:
    """Try a driver on its simulated instrument, in virtual time; exit 1 if it does not meet a requirement."""
    from labctl.services.plugins import check_driver
    from labctl.services.schemas.admin import DriverCheckResponse

    def show(each: DriverCheckResponse) -> None:
        if not as_json:
            console.print(Text("fails  ", "red") if each.problem else Text("does   ", "green"), end="")
            console.print(f"{each.check}{': ' if each.problem else ''}{each.problem}", soft_wrap=True)

    with one_clear_line():
        answer = check_driver(name, bench, show)
    if as_json:
        print_json(answer)
    else:
        failed = sum(1 for each in answer.checks if each.problem)
        said = (
            f"{failed} of {len(answer.checks)} checks failed" if failed else f"all {len(answer.checks)} checks passed"
        )
        console.print(f"{name} of {answer.distribution} {answer.version}: {said}")
    if not answer.ok:
        raise typer.Exit(1)
