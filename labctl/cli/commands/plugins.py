"""`labctl plugins`: what is installed beside labctl, and whether it can be used."""

from __future__ import annotations

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr, table


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
            stderr.print(line, markup=False, soft_wrap=True)
    if any(each.problem for each in found):
        raise typer.Exit(1)
