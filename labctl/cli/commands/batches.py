"""`labctl batches`: batches of units, and which units are of one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import By, Database, Json, who
from labctl.cli.output import console, print_json, table
from labctl.errors import BadInput

if TYPE_CHECKING:
    from labctl.answers.units import BatchResponse

app = typer.Typer(no_args_is_help=True, help="Batches of units: which there are, and which units are of one.")


@app.command("list")
def list_(as_json: Json = False, database: Database = None) -> None:
    """List the batches, and how many units are of each; `labctl units --batch BATCH` lists those of one."""
    from labctl.services.read_access import open_readonly
    from labctl.services.units import batches

    with one_clear_line(), open_readonly(database) as store:
        answers = batches(store)
    if as_json:
        print_json(answers)
    elif not answers:
        console.print("no unit has a batch; `labctl batches set BATCH SERIAL...` states one")
    else:
        _print(answers)


@app.command("set")
def set_(
    batch: Annotated[
        str, typer.Argument(metavar="BATCH", help='Batch of the manufacturer; "": no batch is stated any more.')
    ],
    serials: Annotated[
        list[str] | None, typer.Argument(metavar="SERIAL...", help="Serial numbers of the units.")
    ] = None,
    file: Annotated[
        Path | None, typer.Option("--from", metavar="FILE", help="Text file with more serial numbers, one a line.")
    ] = None,
    supplier: Annotated[
        str | None, typer.Option("--supplier", metavar="NAME", help="Supplier of the units; default: as stated before.")
    ] = None,
    by: By = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """State the batch of units: of all that are named, or of none where one is not in the database."""
    from labctl.answers.units import MAX_SERIALS, BatchRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.registry import SET_BATCH

    with one_clear_line():
        named = [*(serials or ()), *(() if file is None else _serials(file))]
        if not 0 < len(named) <= MAX_SERIALS:
            raise BadInput(
                f"{len(named)} serial numbers were given, 1 to {MAX_SERIALS} are possible; name them after the "
                f"batch, or give a file of them with --from"
            )
        answer = execute(database, SET_BATCH, BatchRequest(batch=batch, serials=named, supplier=supplier, by=who(by)))
    if as_json:
        print_json(answer)
    else:
        _print([answer])


def _serials(file: Path) -> list[str]:
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{file} cannot be read as text ({error}); give a file with one serial number a line") from error
    return [line.strip() for line in lines if line.strip()]


def _print(answers: list[BatchResponse]) -> None:
    rows = table("", "batch", "units")
    for each in answers:
        rows.add_row(each.batch or "none stated", str(each.units))
    console.print(rows)
