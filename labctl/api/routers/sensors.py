"""Versions of a unit's accelerometer and magnetometer."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from labctl.answers.sensors import (
    AccelerometerRequest,
    AccelerometerVersion,
    MagnetometerRequest,
    MagnetometerVersion,
    SensorName,
    SensorVersionResponse,
)
from labctl.api.dependencies import ServiceDep, command_route
from labctl.services.commands.requests import ToUnit
from labctl.services.commands.sensors import KEEP_ACCELEROMETER, KEEP_MAGNETOMETER
from labctl.services.sensor_versions import list_versions, one_accelerometer, one_magnetometer, version_file

router = APIRouter(prefix="/api/units/{serial}/sensors", tags=["sensors"])
Version = Annotated[int | None, Query(description="Number of the version; default: the newest.")]

FormatName = Annotated[
    str, Query(description="px4, ardupilot, json, python, c, tf2, urdf; an accelerometer also kalibr, ros.")
]


@router.get("", summary="Accelerometer and magnetometer of a unit")
def sensors(serial: str, service: ServiceDep) -> list[SensorVersionResponse]:
    """Every version of both, by sensor, the newest first: verdict, data, who and when."""
    return list_versions(service.store, serial)


@router.get("/accelerometer", summary="A version of the accelerometer")
def accelerometer(serial: str, service: ServiceDep, version: Version = None) -> AccelerometerVersion:
    """Bias, scale factors and misalignments with their covariance, and what they were fitted to."""
    return one_accelerometer(service.store, serial, version)


@router.get("/magnetometer", summary="A version of the magnetometer")
def magnetometer(serial: str, service: ServiceDep, version: Version = None) -> MagnetometerVersion:
    """Hard and soft iron with their covariance, and what they were fitted to."""
    return one_magnetometer(service.store, serial, version)


@router.get("/{sensor}/file", summary="A version as a file", response_class=Response)
def file(
    serial: str,
    sensor: SensorName,
    service: ServiceDep,
    format: FormatName,  # noqa: A002  as of a calibration
    version: Version = None,
    instance: Annotated[
        int | None, Query(description="Number of the sensor: px4 from 0, ardupilot from 1; default: the first.")
    ] = None,
    device_id: Annotated[int | None, Query(ge=1, description="Device id of the sensor at the autopilot.")] = None,
) -> Response:
    """The same bytes as `--export` of the command that fitted it; 400 for what the format cannot express."""
    export = version_file(service.store, serial, sensor, version, format, instance, device_id)
    headers = {"ETag": f'"{export.etag}"', "Content-Disposition": f'attachment; filename="{export.name}"'}
    return Response(export.content, media_type=export.media_type, headers=headers)


@command_route(router, KEEP_ACCELEROMETER, "Keep a calibration of the accelerometer")
def keep_accelerometer(serial: str, request: AccelerometerRequest, service: ServiceDep) -> AccelerometerVersion:
    """The unit's next version, with the hashes of the files that it was fitted to; a new unit is added."""
    return service.execute(KEEP_ACCELEROMETER, ToUnit(serial, request))


@command_route(router, KEEP_MAGNETOMETER, "Keep a calibration of the magnetometer")
def keep_magnetometer(serial: str, request: MagnetometerRequest, service: ServiceDep) -> MagnetometerVersion:
    """The unit's next version, with the hashes of the files that it was fitted to; a new unit is added."""
    return service.execute(KEEP_MAGNETOMETER, ToUnit(serial, request))
