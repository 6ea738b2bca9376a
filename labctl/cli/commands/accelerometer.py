"""`labctl accelerometer`: bias, scale factors and misalignments from poses at rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Json
from labctl.cli.output import console, format_number, print_json, table

if TYPE_CHECKING:
    from labctl.services.schemas.reports.accelerometer import AccelerometerResponse


def accelerometer(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="CSV or Parquet files, or folders of recordings in poses, of one unit."),
    ],
    columns: Annotated[
        str, typer.Option("--columns", metavar="T,X,Y,Z", help="Names of the columns: time in s, and three axes.")
    ] = "t_s,accel_x_g,accel_y_g,accel_z_g",
    unit: Annotated[str, typer.Option("--unit", metavar="UNIT", help="Unit of the readings: g, mg or m/s2.")] = "g",
    latitude_deg: Annotated[
        float | None,
        typer.Option("--latitude", metavar="DEG", help="Latitude, for the local gravity; default: 9.80665 m/s2."),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option("--export", metavar="NAME", help="Write parameters of an autopilot, px4 or ardupilot, to --out."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Path of the file to write.")] = None,
    instance: Annotated[
        int | None,
        typer.Option(
            "--instance", metavar="N", help="Number of the accelerometer: px4 from 0, ardupilot from 1; default: first."
        ),
    ] = None,
    device_id: Annotated[
        int | None, typer.Option("--device-id", metavar="ID", min=1, help="Device id of the sensor at the autopilot.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Calibrate an accelerometer by gravity in poses at rest: nine parameters, their uncertainty, and a verdict."""
    from labctl.errors import BadInput
    from labctl.services.accelerometer import Source, accelerometer_of_files, parameters_of

    with one_clear_line():
        if (export is None) != (out is None):
            raise BadInput("give --export and --out together: the format, and the file to write")
        source = Source([name.strip() for name in columns.split(",")], unit, latitude_deg)
        answer, found = accelerometer_of_files(paths, source)
        if export is not None and out is not None:
            out.write_text(parameters_of(answer, found, export, instance, device_id), encoding="ascii")
    if as_json:
        print_json(answer)
    else:
        _print(answer)


def _print(answer: AccelerometerResponse) -> None:
    rows = table("accelerometer", "coefficient", "unit", "value", "u", numbers=2)
    for name, unit, values in (
        ("bias", "g", answer.bias_g),
        ("scale factor", "1", answer.scale_factor),
        ("misalignment", "1", answer.misalignment),
    ):
        for place, found in values.items():
            rows.add_row(f"{name} {place}", unit, format_number(found.value, 5), format_number(found.u, 2))
    console.print(rows)
    console.print(f"verdict: {answer.verdict}", style="green" if answer.verdict == "adequate" else "bold red")
    for line in answer.text:
        console.print(line, soft_wrap=True, markup=False)
    density = max(answer.noise_density_m_s2.values())
    console.print(
        f"{answer.rests - answer.left_out} of {answer.rests} rests used, in {answer.poses} poses; white noise up to "
        f"{density:.2g} m/s2/sqrt(Hz)",
        style="dim",
    )
