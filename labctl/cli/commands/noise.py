"""`labctl allan`: the noise of a unit at rest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, RecordingId
from labctl.cli.output import print_json
from labctl.cli.printing.noise import print_allan


def allan(
    source: Annotated[str, typer.Argument(metavar="SERIAL|FILE", help="A unit, or a file or folder of readings.")],
    column: Annotated[
        str | None, typer.Option("--column", metavar="NAME", help="One column; default: every gyro_ column.")
    ] = None,
    recording: RecordingId = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Allan deviation of a record at rest, with N, B and K of IEEE Std 952; no fit, table or thermometer needed."""
    from labctl.services.commands.open import open_readonly
    from labctl.services.recordings.allan_source import allan_of_file, allan_of_unit

    path = Path(source)
    with one_clear_line():
        if path.exists():
            answer = allan_of_file(path, column)
        else:
            with open_readonly(database) as store:
                answer = allan_of_unit(store, source, recording, column)
    if as_json:
        print_json(answer)
    else:
        print_allan(answer)
