"""`labctl datasheet`: a unit in the terms of IEEE Std 528 and 952, measured beside specified."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Serial
from labctl.cli.output import console, format_number, print_json, table

if TYPE_CHECKING:
    from labctl.services.schemas.datasheet import Characteristic, DatasheetResponse


def datasheet(
    serial: Serial,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write the data sheet to a file, as JSON.")
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show the data sheet of a unit from its recordings; exit 1 if a specified value is not kept."""
    from labctl.services.commands.open import open_readonly
    from labctl.services.datasheet.sheet import datasheet as datasheet_of

    with one_clear_line():
        with open_readonly(database) as store:
            answer = datasheet_of(store, serial)
        if out is not None:
            out.write_text(answer.model_dump_json(indent=2) + "\n", encoding="utf-8")
    print_json(answer) if as_json else _print(answer)
    if answer.passed is False:
        raise typer.Exit(1)


def _print(answer: DatasheetResponse) -> None:
    console.print(f"[bold]{answer.serial}[/] {answer.model}", highlight=False)
    rows = table("", "characteristic", "axis", "value", "u", "unit", "specified", "", "recording", numbers=0)
    for each in answer.characteristics:
        if each.value is None and each.at_most is None:
            rows.add_row(each.title, each.axis, "–", "", each.unit, _specified(each), "", each.why)
            continue
        value = format_number(each.value) if each.value is not None else f"below {format_number(each.at_most)}"
        recording = "" if each.conditions is None else str(each.conditions.recording)
        along = f"{each.axis} per {each.along}" if each.along else each.axis
        rows.add_row(
            each.title, along, value, format_number(each.u, 2), each.unit, _specified(each), _decision(each), recording
        )
    console.print(rows)
    for text in answer.text:
        console.print(text, markup=False, soft_wrap=True)
    console.print(answer.decision_rule, markup=False, soft_wrap=True)


def _specified(each: Characteristic) -> str:
    return "" if each.specified is None else f"{each.specified_as} {each.specified:g}"


def _decision(each: Characteristic) -> str:
    if each.passed is None:
        return ""
    near = ", near" if each.near_limit else ""
    return f"[green]pass{near}[/]" if each.passed else f"[red]fail{near}[/]"
