"""Versions of a unit's accelerometer and magnetometer."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.accelerometer import AccelerometerResponse
from labctl.answers.base import BY_KEY, Request, ResponseModel
from labctl.answers.common_fields import FormatTitle, Person, PersonName, Serial
from labctl.answers.magnetometer import MagnetometerResponse

SensorName = Literal["accelerometer", "magnetometer"]


class MeasuredFile(Request):
    """A file that a result was fitted to."""

    name: str = Field(min_length=1, max_length=300, description="Name of the file, without the folder it was in.")
    sha256: str = Field(pattern="^[0-9a-f]{64}$", description="SHA-256 of its content, as `sha256sum` prints it.")


class MeasuredData(Request):
    """The data behind a result, and how they were read."""

    files: list[MeasuredFile] = Field(
        min_length=1, max_length=1000, description="The files that the result was fitted to."
    )
    read_as: str = Field(
        max_length=1000, description="Columns, their unit, and the local gravity or field that was given."
    )


class AccelerometerRequest(Request):
    """A calibration of an accelerometer, to be kept as the next version of a unit."""

    data: MeasuredData = Field(description="The data that the result was fitted to.")
    result: AccelerometerResponse = Field(description="As `labctl accelerometer FILE --json` prints it.")
    by: PersonName


class MagnetometerRequest(Request):
    """A calibration of a magnetometer, to be kept as the next version of a unit."""

    data: MeasuredData = Field(description="The data that the result was fitted to.")
    result: MagnetometerResponse = Field(description="As `labctl magnetometer FILE --json` prints it.")
    by: PersonName


class SensorFormatResponse(ResponseModel):
    """A format in which a version is available."""

    id: str = Field(description="Name of the format, to be sent as `format`.")
    title: FormatTitle
    suffix: str = Field(description="Suffix of a file in this format, without the dot.")


class SensorCoefficientResponse(ResponseModel):
    """A coefficient of a sensor, or of its alignment."""

    name: str = Field(description="Name, with the axis: bias x, soft iron xy, gyro triad about z.")
    unit: str = Field(description="Unit of the numbers; 1: a ratio.")
    value: float = Field(description="Value, in `unit`.")
    u: float | None = Field(description="Standard uncertainty, in `unit`; null: the value was given.")
    degrees_of_freedom: float | None = Field(
        default=None, description="Degrees of freedom of `u`; null: not stated, U = 2 u."
    )
    expanded: float | None = Field(
        default=None, description="Expanded uncertainty U for 95.45 %, in `unit`; null: the value was given."
    )


class SensorVersionResponse(ResponseModel):
    """A version of a sensor."""

    serial: Serial
    sensor: SensorName = Field(description="The sensor of the unit that was calibrated.")
    version: int = Field(description="From 1, per serial number and sensor; a version never changes.")
    verdict: Literal["adequate", "unexplained"] = Field(
        description="adequate: the fit explains the data to their noise; unexplained: it does not."
    )
    at: datetime = Field(description="When it was stored.")
    by: Person
    by_key: str | None = Field(description=BY_KEY)
    data: MeasuredData = Field(description="The data that the result was fitted to.")
    hash: str = Field(description="SHA-256 of the result in canonical JSON.")
    summary: list[str] = Field(description="What the fit found, in sentences.")
    coefficients: list[SensorCoefficientResponse] = Field(
        description="Every coefficient, and the alignment of the gyro triad or of the magnetometer where it is known."
    )
    formats: list[SensorFormatResponse] = Field(
        description="Formats in which it is available; none for a magnetometer whose field was not constant."
    )


class AccelerometerVersion(SensorVersionResponse):
    """A version of a unit's accelerometer."""

    result: AccelerometerResponse = Field(description="Parameters of the accelerometer.")


class MagnetometerVersion(SensorVersionResponse):
    """A version of a unit's magnetometer."""

    result: MagnetometerResponse = Field(description="Parameters of the magnetometer.")
