"""`labctl inspect`: what is wrong with a file or a recording before anything is fitted to it, with a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.import_dialogue import read_given
from labctl.cli.options import Beside, Database, ImporterName, ImporterOptions, Json, MapFile
from labctl.cli.output import console, print_json
from labctl.cli.printing.inspection import print_inspection

if TYPE_CHECKING:
    from labctl.answers.inspection import InspectionResponse


def inspect(
    source: Annotated[
        str,
        typer.Argument(
            metavar="FILE|RECORDING", help="File or folder that `labctl import` reads, or number of a recording."
        ),
    ],
    importer: ImporterName = None,
    option: ImporterOptions = None,
    column_map: MapFile = None,
    beside: Beside = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="FILE", help="HTML file to write: every channel, and where findings are."),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Inspect a file or a recording before a fit: frozen, clipped or lost readings, spikes, lines, mixed units."""
    from labctl.errors import BadInput
    from labctl.services.read_access import open_readonly
    from labctl.services.recordings.examination import inspection_of_file, inspection_of_recording

    path = Path(source)
    with one_clear_line():
        if path.exists():
            answer = inspection_of_file(path, importer, option or [], read_given(column_map), beside or [])
        elif source.isdecimal():
            with open_readonly(database) as store:
                answer = inspection_of_recording(store, int(source))
        else:
            raise BadInput(f"{source}: not found; name a file or folder, or the number of a recording")
        if picture is not None:
            _write(picture, answer)
    if as_json:
        print_json(answer)
        return
    print_inspection(answer)
    if picture is not None:
        console.print(f"picture -> {picture}")


def _write(path: Path, answer: InspectionResponse) -> None:
    from labctl.errors import BadInput
    from labctl.plots.inspection import inspection_html

    if path.exists():
        raise BadInput(f"--picture {path}: exists already; name a new file")
    sentences = [f"{warning.severity}: {warning.text}" for warning in answer.warnings]
    page = inspection_html(answer.source, sentences, answer.courses, answer.marks)
    path.write_text(page, encoding="utf-8")
