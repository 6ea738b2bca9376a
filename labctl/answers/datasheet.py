"""The performance sheet of a unit: measured characteristics beside specified ones."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import TECHNOLOGY, RecordingNumber, Sentences, Serial, UnitModel


class MeasuredUnder(ResponseModel):
    """Conditions of a measured figure."""

    recording: RecordingNumber
    version: int | None = Field(
        default=None,
        description="Calibration version of which the figure is a coefficient; null: the figure "
        "was computed from the recording.",
    )
    temperature_c: tuple[float, float] | None = Field(
        description="Lowest and highest temperature in the recording, deg C; null: unknown."
    )
    rate_dps: tuple[float, float] | None = Field(description="Lowest and highest rate, deg/s; null: unknown.")
    runs: int | None = Field(description="Number of power-on sessions; null: unknown.")
    datasets: int | None = Field(description="Number of data sets from which the figure was computed; null: unknown.")


class Characteristic(ResponseModel):
    """One line of a performance sheet."""

    id: str = Field(description="Identifier of the characteristic, for programs.")
    title: str = Field(description="Name of the characteristic, by IEEE Std 528 or 952.")
    definition: str = Field(default="", description="How the figure is computed.")
    axis: str = Field(description="Output axis, or pair of axes; empty: the figure is of the whole unit.")
    along: str = Field(
        default="", description="Only for the g-sensitivity: the axis along which the specific force acts; else empty."
    )
    value: float | None = Field(description="Measured value; null: not measured, see `why`.")
    u: float | None = Field(description="Standard uncertainty of `value`; null: unknown.")
    at_most: float | None = Field(
        default=None, description="Upper limit of a figure that cannot be distinguished from zero, in `unit`."
    )
    unit: str = Field(description="Unit of `value`, `u`, `at_most` and `specified`; 1: a ratio.")
    conditions: MeasuredUnder | None = Field(description="Conditions of the measurement; null: not measured.")
    specified: float | None = Field(description="Value of the maker's data sheet, in `unit`; null: not stated.")
    specified_as: Literal["at most", "at least"] = Field(
        description="How `specified` limits the figure: its magnitude is at most, or its value is at least, the "
        "specified value."
    )
    passed: bool | None = Field(
        description="Whether the measured value keeps the specified value, by simple acceptance (ILAC-G8); "
        "null: no decision."
    )
    near_limit: bool = Field(
        default=False,
        description="The specified value is less than 2 u away: the risk of a wrong decision is up to 50 %.",
    )
    why: str = Field(default="", description="Why there is no value, and which recipe measures it; else empty.")


class DatasheetResponse(ResponseModel):
    """The performance sheet of a unit, in the terms of IEEE Std 528 and 952."""

    serial: Serial
    model: UnitModel
    technology: str | None = Field(description=TECHNOLOGY)
    recordings: list[int] = Field(
        description="Ids of the recordings from which the values in this sheet were computed, ascending."
    )
    characteristics: list[Characteristic] = Field(description="Each characteristic, by axis.")
    passed: bool | None = Field(
        description="Whether every figure that is both specified and measured passes; null: there is no such figure."
    )
    not_measured: list[str] = Field(description="Ids of characteristics without a value on any axis.")
    basis: str = Field(default="", description="What the figures are of, and how coefficients of a calibration differ.")
    decision_rule: str = Field(description="Rule by which `passed` was decided.")
    text: Sentences
