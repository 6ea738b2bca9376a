"""A unit's data sheet as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from labctl.cli.output import console, format_number, table

if TYPE_CHECKING:
    from labctl.services.schemas.reports.datasheet import Characteristic, DatasheetResponse


def print_datasheet(answer: DatasheetResponse) -> None:
    """Print each characteristic with its uncertainty beside the specified value, then the decision in words."""
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
