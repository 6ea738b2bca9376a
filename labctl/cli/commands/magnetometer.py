"""`labctl magnetometer`: hard and soft iron from turns in a constant field."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import By, Database, DeviceId, Json, Out, SensorExport, SensorInstance, SensorSerial, who
from labctl.cli.output import print_json
from labctl.cli.printing.sensors import print_kept, print_sensor

Readings = Annotated[
    Path,
    typer.Argument(
        metavar="FILE",
        help="CSV or Parquet file of readings, in order of time, or the folder of a recording in poses, which gives "
        "the alignment too.",
    ),
]


def magnetometer(
    path: Readings,
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
    serial: SensorSerial = None,
    by: By = None,
    export: SensorExport = None,
    out: Out = None,
    instance: SensorInstance = None,
    device_id: DeviceId = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Calibrate a magnetometer: hard iron, soft iron, their uncertainty, and whether the field was constant."""
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToUnit
    from labctl.services.commands.sensors import KEEP_MAGNETOMETER
    from labctl.services.magnetometer import Source, magnetometer_of_file
    from labctl.services.schemas.sensors import MagnetometerRequest
    from labctl.services.sensor_exports import check_export, write_export
    from labctl.services.sensor_versions import measured_data

    kept_version = None
    with one_clear_line():
        check_export(export, out)
        source = Source([name.strip() for name in columns.split(",")], unit, field_ut)
        answer = magnetometer_of_file(path, source, serial)
        write_export(answer, export, out, instance, device_id)
        if serial is not None:
            request = MagnetometerRequest(data=measured_data([path], source.text), result=answer, by=who(by))
            kept_version = execute(database, KEEP_MAGNETOMETER, ToUnit(serial, request))
    if as_json:
        print_json(answer if kept_version is None else kept_version)
    else:
        print_sensor(answer) if kept_version is None else print_kept(kept_version)
