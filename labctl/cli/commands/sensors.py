"""`labctl sensors`: the kept versions of a unit's accelerometer and magnetometer."""

from __future__ import annotations

from typing import Annotated

import typer

from labctl.cli.error_reporting import one_clear_line
from labctl.cli.options import Database, DeviceId, Json, Out, SensorExport, SensorInstance, Serial
from labctl.cli.output import print_json
from labctl.cli.printing.sensors import print_kept, print_versions

app = typer.Typer(no_args_is_help=True, help="Versions of a unit's accelerometer and magnetometer.")


@app.command("list")
def list_(serial: Serial, as_json: Json = False, database: Database = None) -> None:
    """List the versions of both sensors: verdict, who and when, data."""
    from labctl.services.read_access import open_readonly
    from labctl.services.sensor_versions import list_versions

    with one_clear_line(), open_readonly(database) as store:
        answers = list_versions(store, serial)
    print_json(answers) if as_json else print_versions(answers)


@app.command("show")
def show(
    serial: Serial,
    sensor: Annotated[str, typer.Argument(metavar="SENSOR", help="accelerometer or magnetometer.")],
    version: Annotated[
        int | None, typer.Option("--version", metavar="N", help="Number of the version; default: the newest.")
    ] = None,
    export: SensorExport = None,
    out: Out = None,
    instance: SensorInstance = None,
    device_id: DeviceId = None,
    as_json: Json = False,
    database: Database = None,
) -> None:
    """Show a version again, with the files that it was fitted to; with --export, write it as the fit did."""
    from labctl.services.read_access import open_readonly
    from labctl.services.sensor_exports import check_export, write_export
    from labctl.services.sensor_versions import one_version

    with one_clear_line():
        check_export(export, out)
        with open_readonly(database) as store:
            answer = one_version(store, serial, sensor, version)
        write_export(answer.result, export, out, instance, device_id)
    print_json(answer) if as_json else print_kept(answer)
