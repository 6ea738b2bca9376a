"""`labctl reproduce`: tables and figures of a paper, the printed numbers beside."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, RecordingId
from labctl.cli.output import console, format_number, print_json, table
from labctl.cli.stage_line import stage_line

if TYPE_CHECKING:
    from labctl.services.reproduction.answer import NumberResponse, ReproductionResponse


def reproduce(
    paper: Annotated[
        str, typer.Argument(metavar="PAPER", help="Paper to reproduce: ojeda2000, yang2018 or weiss1995.")
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="DIR", help="Folder in which to write PAPER.html and PAPER.json; it is created if needed."
        ),
    ],
    serial: Annotated[
        str | None,
        typer.Argument(
            metavar="[SERIAL]", help="Unit whose recording is used; default: shipped recordings and simulated units."
        ),
    ] = None,
    recording: RecordingId = None,
    axis: Annotated[
        str | None,
        typer.Option("--axis", help="Axis of the unit, for ojeda2000 and weiss1995; default: the unit's first axis."),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Make the tables and figures of a paper again: one page, with the printed numbers beside and why they differ."""
    from labctl.errors import BadInput
    from labctl.services.read_access import open_readonly
    from labctl.services.reproduction.reproduce import reproduce_own, reproduce_unit

    with one_clear_line(), stage_line():
        if serial is not None:
            with open_readonly(database) as store:
                answer = reproduce_unit(store, paper, serial, recording, axis, out)
        elif recording is not None or axis is not None:
            raise BadInput(
                "--recording and --axis choose from the data of a unit; give the serial number of the unit too"
            )
        else:
            answer = reproduce_own(paper, out)
    if as_json:
        print_json(answer)
    else:
        _print(answer)


def _print(answer: ReproductionResponse) -> None:
    rows = table(
        answer.title,
        "place",
        "quantity",
        "unit",
        "made from",
        "origin",
        "printed",
        "reproduced",
        "difference",
        numbers=3,
    )
    for number in answer.numbers:
        rows.add_row(number.place, number.quantity, number.unit, number.of, number.origin, *_cells(number))
    console.print(rows)
    for line in answer.story:
        console.print(line)
    for part in answer.missing:
        console.print(f"not made: {part.what}: {part.why}; record {part.record}", style="yellow")
    console.print(
        f"{len(answer.figures)} figures, {len(answer.contradictions)} contradictions of the paper -> "
        + ", ".join(str(Path(answer.folder) / name) for name in answer.files),
    )


def _cells(number: NumberResponse) -> tuple[str, str, str]:
    printed = f"{number.relation} {format_number(number.printed)}".strip()
    return printed, format_number(number.reproduced), format_number(number.difference, 2)
