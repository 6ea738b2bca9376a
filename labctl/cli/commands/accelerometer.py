"""`labctl accelerometer`: bias, scale factors and misalignments from poses at rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from labctl.cli.earlier_version import Earlier, MisalignmentChange, ScaleChange, Temperature, earlier_version
from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import By, Database, DeviceId, Json, Out, SensorExport, SensorInstance, SensorSerial, who
from labctl.cli.output import print_json
from labctl.cli.printing.sensors import print_kept, print_sensor

if TYPE_CHECKING:
    from labctl.answers.accelerometer import AccelerometerResponse
    from labctl.answers.sensors import AccelerometerVersion, MeasuredData


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
    temperature: Temperature = None,
    serial: SensorSerial = None,
    earlier: Earlier = None,
    scale_change: ScaleChange = 1e-3,
    misalignment_change: MisalignmentChange = 5e-4,
    by: By = None,
    export: SensorExport = None,
    out: Out = None,
    instance: SensorInstance = None,
    device_id: DeviceId = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Calibrate an accelerometer by gravity in poses at rest: nine parameters, their uncertainty, and a verdict."""
    from labctl.services.accelerometer import Source, accelerometer_of_files
    from labctl.services.sensor_exports import check_export, write_export
    from labctl.services.sensor_versions import measured_data

    kept_version = None
    with one_clear_line():
        check_export(export, out)
        source = Source([name.strip() for name in columns.split(",")], unit, latitude_deg, temperature)
        before = earlier_version(database, serial, earlier, (scale_change, misalignment_change))
        answer = accelerometer_of_files(paths, source, serial, before)
        write_export(answer, export, out, instance, device_id)
        if serial is not None:
            kept_version = _kept(database, serial, measured_data(paths, source.text), answer, by)
    if as_json:
        print_json(answer if kept_version is None else kept_version)
    else:
        print_sensor(answer) if kept_version is None else print_kept(kept_version)


def _kept(
    database: str | None, serial: str, data: MeasuredData, answer: AccelerometerResponse, by: str | None
) -> AccelerometerVersion:
    from labctl.answers.sensors import AccelerometerRequest
    from labctl.services.commands.open import execute
    from labctl.services.commands.requests import ToUnit
    from labctl.services.commands.sensors import KEEP_ACCELEROMETER

    request = AccelerometerRequest(data=data, result=answer, by=who(by))
    return execute(database, KEEP_ACCELEROMETER, ToUnit(serial, request))
