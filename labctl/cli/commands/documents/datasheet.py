"""`labctl datasheet`: a unit in the terms of IEEE Std 528, measured beside specified."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Serial
from labctl.cli.output import print_json
from labctl.cli.printing.datasheet import print_datasheet


def datasheet(
    serial: Serial,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write the sheet to a file, as JSON.")
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show the performance sheet of a unit from its recordings; exit 1 if it does not keep the maker's data sheet."""
    from labctl.services.datasheet.sheet import datasheet as datasheet_of
    from labctl.services.read_access import open_readonly

    with one_clear_line():
        with open_readonly(database) as store:
            answer = datasheet_of(store, serial)
        if out is not None:
            out.write_text(answer.model_dump_json(indent=2) + "\n", encoding="utf-8")
    print_json(answer) if as_json else print_datasheet(answer)
    if answer.passed is False:
        raise typer.Exit(1)
