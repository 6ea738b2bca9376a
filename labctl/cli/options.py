"""The options that every command shares."""

from __future__ import annotations

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document on standard output, and nothing else.")]
Database = Annotated[
    str | None,
    typer.Option(
        "--database",
        metavar="URL_OR_PATH",
        help="The database; default: $LABCTL_DATABASE, else the one in the user's data folder.",
    ),
]
Serial = Annotated[str, typer.Argument(metavar="SERIAL", help="Serial number of the unit.")]
AcceptWarnings = Annotated[
    bool,
    typer.Option(
        "--accept-warnings", help="Fit data that are certainly wrong, and keep a fit that is worse than none."
    ),
]
BenchName = Annotated[
    str | None,
    typer.Option("--bench", metavar="FILE", help="Bench file, or the name of a bench that ships with labctl."),
]
CampaignId = Annotated[int | None, typer.Argument(metavar="ID", help="Campaign; default: the newest.")]
RecordingId = Annotated[
    int | None, typer.Option("--recording", metavar="ID", help="Recording; default: the unit's newest.")
]
