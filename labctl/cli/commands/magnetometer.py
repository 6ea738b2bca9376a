"""`labctl magnetometer`: hard and soft iron from turns in a constant field."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Json
from labctl.cli.output import console, format_number, print_json, table

if TYPE_CHECKING:
    from labctl.services.schemas.reports.magnetometer import MagnetometerResponse


def magnetometer(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="CSV or Parquet file of readings, in order of time.")],
    columns: Annotated[
        str, typer.Option("--columns", metavar="X,Y,Z", help="Names of the three columns.")
    ] = "mag_x,mag_y,mag_z",
    unit: Annotated[
        str, typer.Option("--unit", metavar="UNIT", help="Unit of the readings: uT, nT, mT, T, gauss or mgauss.")
    ] = "uT",
    field_ut: Annotated[
        float | None,
        typer.Option(
            "--field-ut",
            metavar="F",
            help="Size of the local field, uT; default: by the readings, with a soft iron of determinant 1.",
        ),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option("--export", metavar="NAME", help="Write parameters of an autopilot, px4 or ardupilot, to --out."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Path of the file to write.")] = None,
    instance: Annotated[
        int | None,
        typer.Option(
            "--instance", metavar="N", help="Number of the magnetometer: px4 from 0, ardupilot from 1; default: first."
        ),
    ] = None,
    device_id: Annotated[
        int | None, typer.Option("--device-id", metavar="ID", min=1, help="Device id of the sensor at the autopilot.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Calibrate a magnetometer: hard iron, soft iron, their uncertainty, and whether the field was constant."""
    from labctl.errors import BadInput
    from labctl.services.magnetometer import magnetometer_of_file, parameters_of

    with one_clear_line():
        if (export is None) != (out is None):
            raise BadInput("give --export and --out together: the format, and the file to write")
        names = [name.strip() for name in columns.split(",")]
        answer, result = magnetometer_of_file(path, names, unit, field_ut)
        if export is not None and out is not None:
            out.write_text(parameters_of(answer, result, export, instance, device_id), encoding="ascii")
    if as_json:
        print_json(answer)
    else:
        _print(answer)


def _print(answer: MagnetometerResponse) -> None:
    rows = table("magnetometer", "coefficient", "unit", "value", "u", numbers=2)
    for axis, found in answer.hard_iron_ut.items():
        rows.add_row(f"hard iron {axis}", "uT", format_number(found.value), format_number(found.u, 2))
    for place, found in answer.soft_iron.items():
        rows.add_row(f"soft iron {place}", "1", format_number(found.value, 5), format_number(found.u, 2))
    rows.add_row("field", "uT", format_number(answer.field_ut.value), format_number(answer.field_ut.u, 2))
    console.print(rows)
    console.print(f"verdict: {answer.verdict}", style="green" if answer.verdict == "adequate" else "bold red")
    for line in answer.text:
        console.print(line, soft_wrap=True, markup=False)
    console.print(
        f"{answer.readings - answer.left_out} of {answer.readings} readings used; from any direction to the nearest "
        f"measured one: up to {answer.largest_gap_deg:.0f} deg",
        style="dim",
    )
