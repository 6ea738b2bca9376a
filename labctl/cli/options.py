"""The options that every command shares."""

from __future__ import annotations

from typing import Annotated

import typer

from labctl.errors import BadInput

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, and nothing else.")]
Database = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL_OR_PATH",
        help="Database file or URL; default: $LABCTL_DATABASE if set, else a file in the user's data folder.",
    ),
]
Serial = Annotated[str, typer.Argument(metavar="SERIAL", help="Serial number of the unit.")]
AcceptWarnings = Annotated[
    bool,
    typer.Option(
        "--accept-warnings",
        help="Fit the data although labctl found errors in them, and keep the fit even if "
        "it is worse than no correction.",
    ),
]
BenchName = Annotated[
    str | None,
    typer.Option("--bench", metavar="FILE", help="Bench file, or the name of a bench that ships with labctl."),
]
CampaignId = Annotated[
    int | None, typer.Argument(metavar="ID", help="Number of the campaign; default: the newest campaign.")
]
RecordingIds = Annotated[
    str | None,
    typer.Option(
        "--recording",
        metavar="ID[,ID...]",
        help="Number of the recording, or several numbers to use recordings together, such as 1,2,3; default: "
        "the unit's newest recording.",
    ),
]
RecordingId = Annotated[
    int | None,
    typer.Option("--recording", metavar="ID", help="Number of the recording; default: the unit's newest recording."),
]


def recording_numbers(given: str | None) -> list[int]:
    """Return the numbers of recordings in "3" or "1,2,3", none where nothing was given. Raises BadInput."""
    found: list[int] = []
    for text in (given or "").split(",") if given is not None else ():
        if not text.strip().isdecimal() or not text.isascii():
            raise BadInput(
                f"--recording {given!r}: {text!r} is not a recording number; write one number such as 3, "
                "or several as 1,2,3"
            )
        found.append(int(text))
    return found
