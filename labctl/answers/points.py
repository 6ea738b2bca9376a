"""A point of a figure: the readings that it is made of, and its numbers computed again from them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import RecordingNumber, Serial, VersionNumber

#: Whose point: the residuals of the fitted model (Explore, Fails), or the version without refitting (Explore, Compare).
PointFigure = Literal["residual", "comparison"]


class PointNumbers(ResponseModel):
    """The numbers of a point: residual = output - rate - modelled error."""

    output_dps: float = Field(description="Mean output of the data set's valid readings, deg/s.")
    own_rate_dps: float = Field(
        description="Rate along the output axis, deg/s; it includes the Earth's rate where that is known."
    )
    measured_error_dps: float = Field(description="Output minus rate, deg/s.")
    modelled_error_dps: float = Field(description="Error that the model states, deg/s.")
    residual_dps: float = Field(description="Measured error minus modelled error, deg/s.")


class PointResponse(ResponseModel):
    """One data set of one axis in a figure, and the same computed again from its raw readings."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    dataset: int = Field(description="Number of the data set.")
    axis: str = Field(description="Output axis: x, y or z.")
    figure: PointFigure = Field(description="The figure whose point it is.")
    shown: PointNumbers = Field(description="The numbers of the figure.")
    recomputed: PointNumbers | None = Field(
        description="The same computed now from the raw readings; of the figure `residual` the modelled error is that "
        "of the fit to all data sets. null: the recording has no readings."
    )
    equal: bool | None = Field(
        description="Whether both agree within the rounding of a mean, `rounding_dps`; null: there are no readings."
    )
    largest_difference_dps: float | None = Field(
        description="Largest difference between `shown` and `recomputed`, deg/s; null: there are no readings."
    )
    rounding_dps: float = Field(description="Difference up to which both are equal, deg/s.")
    readings: int = Field(description="Number of valid readings; 0: the recording has none.")
    invalid: int = Field(description="Number of readings that the instrument marked as invalid; none of them counts.")
    std_dps: float | None = Field(
        description="Standard deviation of the readings (n - 1), deg/s; null: fewer than two readings."
    )
    readings_sha256: str | None = Field(
        description="SHA-256 of the valid readings of the output, each as 8 bytes (little-endian double), in order; "
        "null: there are no readings."
    )
    formula: str = Field(description="The residual with its numbers.")
    summary: str = Field(description="The result of the computation from the readings, in one sentence.")


#: Figures of a recording or of a unit over time whose points are computed again from raw readings.
RecomputedFigure = Literal["allan", "trace", "mean", "trend"]
#: What a point of the trend of a unit states.
TrendQuantity = Literal["bias", "scale_factor", "error", "as_found", "as_left"]


class FigureNumber(ResponseModel):
    """One number of a point, and the same computed now from the raw readings."""

    name: str = Field(description="What the number is.")
    unit: str = Field(description="Its unit; empty: a number without a unit.")
    shown: float | None = Field(description="The number of the figure, in `unit`; null: the figure does not state it.")
    recomputed: float | None = Field(
        description="The same computed now from the raw readings, in `unit`; null: there are no readings."
    )
    rounding: float = Field(description="Difference up to which both are equal, in `unit`.")


class FigurePointResponse(ResponseModel):
    """A point of an Allan deviation, of a trace, of the means of data sets or of a trend: what it is made of."""

    figure: RecomputedFigure = Field(description="The figure whose point it is.")
    title: str = Field(description="The point in words.")
    recording: RecordingNumber
    datasets: list[int] = Field(description="Numbers of the first and the last data set that its readings are of.")
    numbers: list[FigureNumber] = Field(description="Its numbers; the first is the one that is drawn.")
    formula: str = Field(description="How the drawn number follows from the readings, with its numbers.")
    equal: bool | None = Field(
        description="Whether all numbers agree within their rounding; null: there are no readings."
    )
    readings: int = Field(description="Number of readings that it is made of; 0: the recording has none.")
    readings_sha256: str | None = Field(
        description="SHA-256 of these readings, each as 8 bytes (little-endian double), in order; null: none."
    )
    summary: str = Field(description="The result of the computation from the readings, in one sentence.")
