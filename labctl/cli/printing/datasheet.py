"""A unit's performance sheet as text."""

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
    for characteristic in answer.characteristics:
        if characteristic.value is None and characteristic.at_most is None:
            rows.add_row(
                characteristic.title,
                characteristic.axis,
                "–",
                "",
                characteristic.unit,
                _specified(characteristic),
                "",
                characteristic.why,
            )
            continue
        value = (
            format_number(characteristic.value)
            if characteristic.value is not None
            else f"below {format_number(characteristic.at_most)}"
        )
        recording = "" if characteristic.conditions is None else str(characteristic.conditions.recording)
        along = f"{characteristic.axis} per {characteristic.along}" if characteristic.along else characteristic.axis
        rows.add_row(
            characteristic.title,
            along,
            value,
            format_number(characteristic.u, 2),
            characteristic.unit,
            _specified(characteristic),
            _decision(characteristic),
            recording,
        )
    console.print(rows)
    for text in answer.text:
        console.print(text, soft_wrap=True)
    measured = {each.title: each.definition for each in answer.characteristics if each.conditions is not None}
    for title, definition in measured.items():
        console.print(f"{title}: {definition}", style="dim", soft_wrap=True)
    console.print(answer.basis, soft_wrap=True)
    console.print(answer.decision_rule, soft_wrap=True)


def _specified(each: Characteristic) -> str:
    return "" if each.specified is None else f"{each.specified_as} {each.specified:g}"


def _decision(each: Characteristic) -> Text:
    if each.passed is None:
        return Text()
    near = ", near" if each.near_limit else ""
    return Text(f"pass{near}", "green") if each.passed else Text(f"fail{near}", "red")
