"""Answer of a calibration version held beside a recording, as it is."""

from __future__ import annotations

from pydantic import Field

from labctl.json_types.models import LeftOut
from labctl.services.schemas.base import ResponseModel


class ModelLines(ResponseModel):
    """The model's error (output minus true rate) of one output axis in one position.

    A row for each level, a number for each `at` in it.
    """

    axis: str
    position: str
    level: list[float] = Field(description="Temperature, deg C, or table rate, deg/s, of each line.")
    levels: int = Field(description="How many levels the recording has; more than lines: evenly picked.")
    at: list[float] = Field(description="Table rate, deg/s, or temperature, deg C, along the lines.")
    error_dps: list[list[float]]


class ComparisonColumns(ResponseModel):
    """One row per data set (or piece of a long one) and output axis, as lists of equal length."""

    recording: list[int] = Field(default_factory=list, description="Number of the recording.")
    dataset: list[int] = Field(default_factory=list, description="Number of the data set in its recording.")
    axis: list[str] = Field(default_factory=list, description="The output axis.")
    position: list[str] = Field(default_factory=list, description="The body axis that lay along the table axis.")
    table_rate_dps: list[float] = Field(default_factory=list)
    own_rate_dps: list[float] = Field(default_factory=list, description="True rate along the output axis.")
    temperature_c: list[float] = Field(default_factory=list)
    temperature_level_c: list[float] = Field(default_factory=list, description="Centre of its temperature level.")
    rate_level_dps: list[float] = Field(default_factory=list, description="Centre of its level of the table rate.")
    measured_error_dps: list[float] = Field(default_factory=list, description="Output minus own rate.")
    modelled_error_dps: list[float] = Field(
        default_factory=list, description="What the version subtracts: output minus corrected rate."
    )
    residual_dps: list[float] = Field(default_factory=list, description="Residual: corrected rate minus own rate.")
    turn_before_deg: list[float | None] = Field(
        default_factory=list,
        description="Error after a full turn with the static bias alone taken off; null: too slow, another axis turns, "
        "or the recording has nothing at rest.",
    )
    turn_after_deg: list[float | None] = Field(default_factory=list, description="The same after the calibration.")


class ComparisonResponse(ResponseModel):
    """A version applied without refitting, and a recording."""

    serial: str
    version: int
    recording: int
    recordings: list[int] = Field(default_factory=list, description="All recordings; `recording` is the newest.")
    fitted_to: int | None = Field(description="The recording that the version was fitted to.")
    source: str = Field(description="Which model all numbers here come from, in words.")
    held: dict[str, float] = Field(description="Other channels that the lines need: their means in this recording.")
    left_out: list[LeftOut] = Field(description="Effects of the fit that are not exported with the calibration.")
    least_turn_rate_dps: float = Field(description="The error per turn is given from this rate on.")
    at_rest_dps: float = Field(description="Below this table rate a data set is at rest.")
    columns: ComparisonColumns
    over_rate: list[ModelLines] = Field(description="A line over the table rate for each temperature level.")
    over_temperature: list[ModelLines] = Field(description="A line over temperature for each level of the table rate.")
