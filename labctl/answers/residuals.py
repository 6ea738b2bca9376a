"""The residuals of a version on recordings, by data set and axis."""

from __future__ import annotations

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import (
    POSITION,
    DatasetNumbers,
    RecordingNumber,
    Serial,
    TableRates,
    VersionNumber,
)


class ResidualColumns(ResponseModel):
    """One row per data set and axis, as lists of equal length. A data set far longer than the others is in pieces."""

    recording: list[int] = Field(default_factory=list, description="Number of the recording.")
    dataset: DatasetNumbers = Field(default_factory=list)
    axis: list[str] = Field(default_factory=list, description="Output axis: x, y or z.")
    position: list[str] = Field(default_factory=list, description=POSITION)
    run: list[int] = Field(default_factory=list, description="Number of the run, a powered session of the unit.")
    table_rate_dps: TableRates = Field(default_factory=list)
    own_rate_dps: list[float] = Field(
        default_factory=list,
        description="True rate along the output axis, deg/s; it includes the Earth's rate where that is known.",
    )
    temperature_c: list[float] = Field(
        default_factory=list, description="Mean temperature of the unit during the data set, deg C."
    )
    t_s: list[float | None] = Field(
        default_factory=list, description="Mean time of the data set, s since the recording began; null: not known."
    )
    n: list[int | None] = Field(default_factory=list, description="Number of readings in the data set; null: unknown.")
    measured_error_dps: list[float] = Field(
        default_factory=list, description="Error of the output: output minus true rate along the axis, deg/s."
    )
    modelled_error_dps: list[float] = Field(
        default_factory=list, description="Error that the model states: output minus true rate along the axis, deg/s."
    )
    residual_dps: list[float] = Field(default_factory=list, description="Measured error minus modelled error, deg/s.")
    floor_dps: list[float | None] = Field(
        default_factory=list, description="Standard deviation of the data set's mean due to noise alone, deg/s."
    )
    over_floor: list[float | None] = Field(
        default_factory=list, description="Residual divided by the noise floor, as in the map."
    )


class ResidualsResponse(ResponseModel):
    """The residual of a version on a recording."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recordings: list[int] = Field(
        default_factory=list, description="All recordings that the model is compared with; `recording` is the newest."
    )
    columns: ResidualColumns = Field(description="Residual of each data set and axis.")
