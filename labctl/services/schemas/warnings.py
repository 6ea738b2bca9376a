"""Warnings: what is certainly or probably wrong with data, or with a fit to them."""

from __future__ import annotations

from pydantic import Field

from labctl.json_types.findings import Severity
from labctl.services.schemas.base import ResponseModel

WARNINGS = (
    "Errors of the data or the fit that are certain or probable, the certain ones first; empty where there are none."
)


class DataWarning(ResponseModel):
    """One thing that is wrong: what, where, its value, what was expected, and what to do."""

    what: str = Field(description="A word for programs: sign, unit, scale, axes, one_data_set, time_unit, worse ...")
    severity: Severity = Field(description="certain: a fit is refused; likely: it is only said.")
    where: str = Field(description="Axis, position, data sets or column.")
    said: str
    value: float | None
    unit: str
    expected: str
    do: str
    text: str = Field(description="All of it as one sentence.")


class RecordingInspection(ResponseModel):
    """What an inspection of all readings of a recording found, as it is cached."""

    warnings: list[DataWarning]
    dataset: list[int] = Field(description="Data sets that the lists below are of.")
    rate_low_dps: list[float]
    rate_high_dps: list[float]
    temperature_low_c: list[float | None]
    temperature_high_c: list[float | None]
    position: list[str]
    quantisation_dps: dict[str, list[float]] = Field(description="Axis -> what coarse steps leave in each mean.")
