"""`labctl uncertainty`: the uncertainty budget of a version."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, Json, Serial
from labctl.cli.output import console, print_json


def uncertainty(
    serial: Serial,
    version: Annotated[
        int | None, typer.Option("--version", metavar="N", help="Calibration version; default: the newest version.")
    ] = None,
    rate_dps: Annotated[
        str | None,
        typer.Option(
            "--rate-dps",
            metavar="DPS|X,Y,Z",
            help="Rate, deg/s, about one axis after the other, or a rate vector about x, y and z, such as 10,0,-80; "
            "default: half of the largest calibrated rate.",
        ),
    ] = None,
    temperature_c: Annotated[
        float | None,
        typer.Option(
            "--temperature-c", metavar="C", help="Temperature, deg C; default: the middle of the calibrated range."
        ),
    ] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            "--figure",
            metavar="FILE.html",
            help="Path of an HTML file to write: the contributions over rate and temperature.",
        ),
    ] = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Print the uncertainty budget of a corrected rate and of the coefficients, line by line (GUM)."""
    from labctl.services.calibrations.contributions import write_figure
    from labctl.services.calibrations.uncertainty import uncertainty_of_unit
    from labctl.services.read_access import open_readonly

    with one_clear_line(), open_readonly(database) as store:
        answer = uncertainty_of_unit(
            store, serial, version, _rates(rate_dps), temperature_c, grid=as_json or figure is not None
        )
        if figure is not None:
            write_figure(answer, figure)
    if as_json:
        print_json(answer)
        return
    from labctl.cli.printing.uncertainty import print_uncertainty

    print_uncertainty(answer)
    if figure is not None:
        console.print(f"contributions -> {figure}")


def _rates(text: str | None) -> list[float] | None:
    """Return one rate or three from a text; raises BadInput."""
    from labctl.errors import BadInput

    try:
        return None if text is None else [float(part) for part in text.split(",")]
    except ValueError:
        raise BadInput(
            f"--rate-dps {text!r}: give one rate in deg/s, or three about x, y and z with commas, such as 10,0,-80"
        ) from None
