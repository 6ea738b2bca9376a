"""Validity of results (ISO/IEC 17025:2017, 7.7): check gyros, comparisons, environment of the room."""

from __future__ import annotations

from datetime import date, datetime
from typing import Literal

from pydantic import AwareDatetime, Field

from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import (
    ROOM_UNIT,
    OutputAxis,
    PersonName,
    ReadingCount,
    RecordingNumber,
    Sentences,
    Serial,
    StatedReason,
    VersionNumber,
)
from labctl.answers.standards import ChartLimits, ChartState

Performance = Literal["satisfactory", "questionable", "unsatisfactory"]


class CheckGyroRequest(Request):
    """Make a unit a check gyro, or end that."""

    marked: bool = Field(default=True, description="false: the unit is no check gyro any more.")
    temperature_c: float | None = Field(
        default=None, ge=-100, le=200, description="Temperature of the bias on the chart, deg C; default: the middle "
        "of the range of the unit's first version."
    )  # fmt: skip
    chart_from: date | None = Field(
        default=None, description="First day of the chart, such as after a repair; default: all recordings."
    )
    reason: StatedReason = Field(min_length=1, max_length=2000)
    by: PersonName


class CheckGyroPoint(ResponseModel):
    """The result of one recording."""

    recording: RecordingNumber
    campaign: int | None = Field(description="null: the recording was imported.")
    at: datetime = Field(description="Time of the measurement.")
    version: int = Field(description="The newest version that was fitted to this recording alone.")
    value: float = Field(description="Value of the result, in the unit of the chart.")
    u: float | None = Field(description="Standard uncertainty; null: unknown.")
    state: ChartState = Field(description="out: beyond three standard deviations by any of the limits.")
    limits: list[ChartLimits] = Field(description="Control limits of this point.")


class CheckGyroChart(ResponseModel):
    """One result of a check gyro over its campaigns."""

    axis: OutputAxis
    result: Literal["bias", "scale_factor"] = Field(description="The result that the chart follows.")
    unit: str = Field(description="Unit of the result.")
    points: list[CheckGyroPoint] = Field(
        description="One point for each recording with a version of its own, in order of time."
    )


class CheckGyroResponse(ResponseModel):
    """A check gyro: a unit that is measured in each campaign to check the bench."""

    serial: Serial
    marked: bool = Field(description="Whether the unit is a check gyro; its charts can be drawn in any case.")
    temperature_c: float = Field(description="Temperature of the bias, deg C.")
    chart_from: date | None = Field(description="First day of the chart; null: all recordings.")
    alarm: bool = Field(description="Whether a result of the newest recording is out of the control limits.")
    charts: list[CheckGyroChart] = Field(description="Chart of each result and axis.")
    left_out: dict[int, str] = Field(description="Recordings without a point, and why.")
    text: Sentences


class ComparedCalibration(ResponseModel):
    """One side of a comparison."""

    serial: Serial
    version: VersionNumber
    bench: str = Field(description="Name of the bench; empty: not known.")
    laboratory: str = Field(description="Name of the laboratory of the bench; empty: not stated.")
    measured_on: date | None = Field(description="First day of its newest recording; null: not known.")


class ComparedResult(ResponseModel):
    """One result of both calibrations with En number and zeta score."""

    axis: OutputAxis
    result: str = Field(description="Name of the result, such as bias or scale_factor.")
    unit: str = Field(description="Unit of the result.")
    values: tuple[float, float] = Field(description="Value of the first and of the second calibration, in `unit`.")
    expanded: tuple[float, float] = Field(description="Expanded uncertainties, probability 95.45 %.")
    k: tuple[float, float] = Field(description="Coverage factors of these expanded uncertainties.")
    difference: float = Field(description="First minus second.")
    shared_u: float = Field(description="Root of the covariance by the standards that both rest on; 0: independent.")
    en: float = Field(description="En number (ISO 13528:2015, 9.7), the shared part subtracted.")
    en_performance: Performance = Field(description="satisfactory: |En| <= 1; unsatisfactory: larger.")
    zeta: float = Field(description="Zeta score (ISO 13528:2015, 9.6), the shared part subtracted.")
    zeta_performance: Performance = Field(
        description="satisfactory: |zeta| <= 2; questionable: above 2 and below 3; unsatisfactory: 3 or above."
    )
    en_if_independent: float = Field(description="En number without regard to what both share.")


class LaboratoryComparison(ResponseModel):
    """Two calibrations of one unit compared."""

    first: ComparedCalibration = Field(description="The first calibration.")
    second: ComparedCalibration = Field(description="The second calibration.")
    temperature_c: float = Field(description="Temperature at which the results were compared, deg C.")
    results: list[ComparedResult] = Field(description="Each result that both calibrations have.")
    shared: list[str] = Field(description="Standards that both calibrations rest on: they are correlated by these.")
    not_compared: dict[str, str] = Field(description="Results without a comparison, and why.")
    satisfactory: bool = Field(description="Whether |En| <= 1 for every result.")
    text: Sentences


class RoomValue(Request):
    """One value of the environment of the room."""

    quantity: Literal["temperature", "humidity", "pressure"] = Field(description="Quantity that was read.")
    value: float = Field(allow_inf_nan=False, description="Value of the reading, in `unit`.")
    unit: str = Field(description="deg C, K or deg F; %; hPa, mbar, kPa or Pa.")


class RoomRecord(Request):
    """Values of one time."""

    measured_at: AwareDatetime | None = Field(default=None, description="Default: now.")
    values: list[RoomValue] = Field(min_length=1, max_length=20, description="Values that were read at this time.")


class RoomEnvironmentRequest(Request):
    """Readings of the environment of the room, by an instrument that logs or by a person who reads."""

    readings: list[RoomRecord] = Field(min_length=1, max_length=5000, description="Readings, each with its time.")
    source: str = Field(min_length=1, max_length=200, description="The instrument, with its number.")
    bench: str = Field(
        default="", max_length=200, description="Name of the bench that they hold for; empty: all benches."
    )
    by: PersonName | None = Field(
        default=None, description="The person who read and typed them; "
        "then the audit trail has a row. null: an instrument logged them."
    )  # fmt: skip


class RoomReadingResponse(ResponseModel):
    """One reading."""

    measured_at: datetime = Field(description="Time of the reading.")
    bench: str = Field(description="Name of the bench that the reading holds for; empty: all benches.")
    quantity: str = Field(description="Quantity that was read: temperature, humidity or pressure.")
    unit: str = Field(description=ROOM_UNIT)
    value: float = Field(description="Value of the reading, in `unit`.")
    source: str = Field(description="The instrument, with its number.")


class RoomSpanResponse(ResponseModel):
    """Least and largest reading of a quantity."""

    quantity: str = Field(description="Quantity that was read: temperature, humidity or pressure.")
    unit: str = Field(description=ROOM_UNIT)
    low: float = Field(description="Smallest reading, in `unit`.")
    high: float = Field(description="Largest reading, in `unit`.")
    readings: ReadingCount


class RoomEnvironmentResponse(ResponseModel):
    """The environment of the room over a time."""

    spans: list[RoomSpanResponse] = Field(description="Smallest and largest reading of each quantity over that time.")
    readings: list[RoomReadingResponse] = Field(description="The newest first, at most 1000.")
