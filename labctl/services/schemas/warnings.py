"""Warnings: what is certainly or probably wrong with data, or with a fit to them."""

from __future__ import annotations

from pydantic import Field

from labctl.json_types.findings import Part, Severity
from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.common_fields import POSITION

WARNINGS = "Certain and probable errors of the data or of the fit, the certain errors first; empty if there are none."


class DataWarning(ResponseModel):
    """One thing that is wrong: what, where, its value, what was expected, and what to do."""

    what: str = Field(
        description="Kind of error, as a fixed word for programs: sign, unit, scale, axes, one_data_set, "
        "time_unit, worse ..."
    )
    severity: Severity = Field(
        description="How sure labctl is that the data are wrong. `certain`: labctl refuses to fit; `likely`: labctl "
        "fits and shows the warning."
    )
    where: str = Field(description="The axis, position, data sets or column that the warning concerns.")
    said: str = Field(description="What is the case, in words, with value and unit.")
    value: float | None = Field(description="Value that was found, in `unit`; null: the warning has no number.")
    unit: str = Field(description="Unit of `value`; empty: none.")
    expected: str = Field(description="What was expected, in words.")
    do: str = Field(description="What to do.")
    text: str = Field(description="The whole warning as one sentence.")
    part: Part = Field(
        default="fitted",
        description="The part of the recording that the warning concerns. `fitted`: what a fit takes in; "
        "`verification`: data sets measured to verify a calibration, whose errors refuse no fit but a certification.",
    )
    channel: str = Field(
        default="", description="Of single readings: the column that the warning concerns; empty: whole rows."
    )
    n: int | None = Field(
        default=None, description="How many readings the warning concerns; null: it is not about single readings."
    )
    may_leave_out: bool = Field(
        default=False, description="Whether those readings can be left out (`labctl import --leave-out`)."
    )


class RecordingInspection(ResponseModel):
    """What an inspection of all readings of a recording found, as it is cached."""

    warnings: list[DataWarning] = Field(description=WARNINGS)
    dataset: list[int] = Field(
        description="Numbers of the data sets; the other lists have one entry for each of these."
    )
    rate_low_dps: list[float] = Field(description="Smallest rate of the table in each data set, deg/s.")
    rate_high_dps: list[float] = Field(description="Largest rate of the table in each data set, deg/s.")
    temperature_low_c: list[float | None] = Field(
        description="Lowest temperature in each data set, deg C; null: not measured."
    )
    temperature_high_c: list[float | None] = Field(
        description="Highest temperature in each data set, deg C; null: not measured."
    )
    position: list[str] = Field(description=POSITION)
    quantisation_dps: dict[str, list[float]] = Field(
        description="For each axis: standard uncertainty of each mean due to the resolution of the readings, deg/s."
    )
