"""`labctl export bundle`: the certified calibrations of many units in one signed file."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json
from labctl.cli.output import console, print_json, stderr
from labctl.errors import BadInput
from labctl.texts import counted


def export_bundle(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="New file to write; it must not exist.")],
    model: Annotated[
        str | None, typer.Option("--type", metavar="NAME", help="Units of this model only, as `labctl units` shows it.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Units of every model.")] = False,
    days: Annotated[
        float | None,
        typer.Option(
            "--valid-days", metavar="D", min=0, help="Days after which the bundle is refused; default: no such date."
        ),
    ] = None,
    unsigned: Annotated[
        bool, typer.Option("--unsigned", help="Write the bundle without a signature, where there is no seal key.")
    ] = False,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Write the certified calibrations of one model, or of all units, into one signed file for vehicles without a
    network.
    """
    from instruments.clock import SystemClock
    from labctl.services.calibrations.bundle import BundleOptions, write_bundle
    from labctl.services.read_access import open_readonly

    with one_clear_line():
        if (model is None) is not every:
            raise BadInput("a bundle is of one model or of all units; give either --type NAME or --all")
        valid_for = None if days is None else timedelta(days=days)
        with open_readonly(database) as store:
            answer = write_bundle(store, file, BundleOptions(model, valid_for, unsigned), SystemClock().utc())
    if as_json:
        print_json(answer)
        return
    signed = "without a signature" if answer.signed_by is None else f"signed by the key {answer.signed_by}"
    console.print(f"{counted(answer.calibrations, 'calibration')} -> {answer.file}, {signed}", soft_wrap=True)
    if answer.withdrawn:
        verb = "is" if answer.withdrawn == 1 else "are"
        text = f"{counted(answer.withdrawn, 'unit')} {verb} named as withdrawn, without a calibration"
        stderr.print(text, style="yellow")
