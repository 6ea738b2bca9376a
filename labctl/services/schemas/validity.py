"""Validity of results (ISO/IEC 17025:2017, 7.7): check gyros, comparisons, environment of the room."""

from __future__ import annotations

from datetime import date, datetime
from typing import Literal

from pydantic import AwareDatetime, Field

from labctl.services.schemas.base import Request, ResponseModel
from labctl.services.schemas.standards import ChartLimits, ChartState

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
    reason: str = Field(min_length=1, max_length=2000)
    by: str = Field(min_length=1, max_length=200)


class CheckGyroPoint(ResponseModel):
    """The result of one recording."""

    recording: int
    campaign: int | None = Field(description="null: the recording was imported.")
    at: datetime
    version: int = Field(description="The newest version that was fitted to this recording alone.")
    value: float
    u: float | None = Field(description="Standard uncertainty; null: unknown.")
    state: ChartState = Field(description="out: beyond three standard deviations by any of the limits.")
    limits: list[ChartLimits]


class CheckGyroChart(ResponseModel):
    """One result of a check gyro over its campaigns."""

    axis: str
    result: Literal["bias", "scale_factor"]
    unit: str
    points: list[CheckGyroPoint]


class CheckGyroResponse(ResponseModel):
    """A check gyro: a unit that is measured in each campaign to check the bench."""

    serial: str
    marked: bool = Field(description="Whether the unit is a check gyro; its charts can be drawn in any case.")
    temperature_c: float = Field(description="Temperature of the bias, deg C.")
    chart_from: date | None
    alarm: bool = Field(description="Whether a result of the newest recording is out of the control limits.")
    charts: list[CheckGyroChart]
    left_out: dict[int, str] = Field(description="Recordings without a point, and why.")
    text: list[str]


class ComparedCalibration(ResponseModel):
    """One side of a comparison."""

    serial: str
    version: int
    bench: str = Field(description="Name of the bench; empty: not known.")
    laboratory: str = Field(description="Name of the laboratory of the bench; empty: not stated.")
    measured_on: date | None = Field(description="First day of its newest recording; null: not known.")


class ComparedResult(ResponseModel):
    """One result of both calibrations with En number and zeta score."""

    axis: str
    result: str
    unit: str
    values: tuple[float, float]
    expanded: tuple[float, float] = Field(description="Expanded uncertainties, probability 95.45 %.")
    k: tuple[float, float]
    difference: float = Field(description="First minus second.")
    shared_u: float = Field(description="Root of the covariance by the standards that both rest on; 0: independent.")
    en: float = Field(description="En number (ISO 13528:2015, 9.7), the shared part subtracted.")
    en_performance: Performance
    zeta: float = Field(description="Zeta score (ISO 13528:2015, 9.6), the shared part subtracted.")
    zeta_performance: Performance
    en_if_independent: float = Field(description="En number without regard to what both share.")


class LaboratoryComparison(ResponseModel):
    """Two calibrations of one unit compared."""

    first: ComparedCalibration
    second: ComparedCalibration
    temperature_c: float
    results: list[ComparedResult]
    shared: list[str] = Field(description="Standards that both calibrations rest on: they are correlated by these.")
    not_compared: dict[str, str] = Field(description="Results without a comparison, and why.")
    satisfactory: bool = Field(description="Whether |En| <= 1 for every result.")
    text: list[str]


class RoomValue(Request):
    """One value of the environment of the room."""

    quantity: Literal["temperature", "humidity", "pressure"]
    value: float = Field(allow_inf_nan=False)
    unit: str = Field(description="deg C, K or deg F; %; hPa, mbar, kPa or Pa.")


class RoomRecord(Request):
    """Values of one time."""

    measured_at: AwareDatetime | None = Field(default=None, description="Default: now.")
    values: list[RoomValue] = Field(min_length=1, max_length=20)


class RoomEnvironmentRequest(Request):
    """Readings of the environment of the room, by an instrument that logs or by a person who reads."""

    readings: list[RoomRecord] = Field(min_length=1, max_length=5000)
    source: str = Field(min_length=1, max_length=200, description="The instrument, with its number.")
    bench: str = Field(
        default="", max_length=200, description="Name of the bench that they hold for; empty: all benches."
    )
    by: str | None = Field(
        default=None, min_length=1, max_length=200, description="The person who read and typed them; "
        "then the audit trail has a row. null: an instrument logged them."
    )  # fmt: skip


class RoomReadingResponse(ResponseModel):
    """One reading."""

    measured_at: datetime
    bench: str
    quantity: str
    unit: str
    value: float
    source: str


class RoomSpanResponse(ResponseModel):
    """Least and largest reading of a quantity."""

    quantity: str
    unit: str
    low: float
    high: float
    readings: int


class RoomEnvironmentResponse(ResponseModel):
    """The environment of the room over a time."""

    spans: list[RoomSpanResponse]
    readings: list[RoomReadingResponse] = Field(description="The newest first, at most 1000.")
