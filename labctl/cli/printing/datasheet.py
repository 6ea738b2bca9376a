"""A unit's data sheet as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from labctl.cli.output import console, format_number, print_heading, table

if TYPE_CHECKING:
    from labctl.answers.datasheet import Characteristic, DatasheetResponse


def print_datasheet(answer: DatasheetResponse) -> None:
    """Print each characteristic with its uncertainty beside the specified value, then the decision in words."""
    print_heading(answer.serial, f" {answer.model}")
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
        console.print(text, soft_wrap=True)
    console.print(answer.decision_rule, soft_wrap=True)


def _specified(each: Characteristic) -> str:
    return "" if each.specified is None else f"{each.specified_as} {each.specified:g}"


def _decision(each: Characteristic) -> Text:
    if each.passed is None:
        return Text()
    near = ", near" if each.near_limit else ""
    return Text(f"pass{near}", "green") if each.passed else Text(f"fail{near}", "red")
