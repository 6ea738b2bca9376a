"""Commands that keep the calibration of a unit's accelerometer or magnetometer."""

from __future__ import annotations

from labctl.answers.sensors import AccelerometerRequest, AccelerometerVersion, MagnetometerRequest, MagnetometerVersion
from labctl.services.commands.command import Command
from labctl.services.commands.context import CommandContext
from labctl.services.commands.requests import ToUnit
from labctl.services.sensor_versions import keep_accelerometer, keep_magnetometer


def _accelerometer(context: CommandContext, request: ToUnit[AccelerometerRequest]) -> AccelerometerVersion:
    return keep_accelerometer(context.store, request.serial, request.body, context.now())


def _magnetometer(context: CommandContext, request: ToUnit[MagnetometerRequest]) -> MagnetometerVersion:
    return keep_magnetometer(context.store, request.serial, request.body, context.now())


_UNIT = "/api/units/{serial}/sensors"

KEEP_ACCELEROMETER = Command(
    method="POST", path=_UNIT + "/accelerometer", handler=_accelerometer, responses={201: AccelerometerVersion}
)
KEEP_MAGNETOMETER = Command(
    method="POST", path=_UNIT + "/magnetometer", handler=_magnetometer, responses={201: MagnetometerVersion}
)
