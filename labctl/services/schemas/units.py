"""Units: who they are and what is known of them."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from labctl.services.schemas.base import ResponseModel


class ExportFormatResponse(ResponseModel):
    """A format in which calibrations are available."""

    id: str = Field(description="The value of `format`.")
    title: str
    suffix: str = Field(description="Of a file name, without the dot.")


class UnitResponse(ResponseModel):
    """A unit, its recordings and its calibrations."""

    serial: str
    model: str
    technology: str | None
    recordings: list[int]
    calibrations: list[int]
    certified_version: int | None
    formats: list[ExportFormatResponse] = Field(description="Formats in which its calibrations are available.")


class AppliedVersion(ResponseModel):
    """A version applied to a recording without refitting."""

    version: int
    rms_dps: float
    max_dps: float
    bias_dps: float


class TrendPoint(ResponseModel):
    """One recording of the unit."""

    recording: int
    at: datetime
    as_found: AppliedVersion | None = Field(description="The newest version of before; null: there was none.")
    as_left: AppliedVersion | None = Field(description="The newest version fitted to it; null: none was.")
    rms_dps: float | None = Field(description="Error of the version that the trend is of; null: not applicable.")
    axes: dict[str, AxisPoint] = Field(description="axis -> what that version leaves of bias and scale factor.")
    why: str = Field(default="", description="Why the version cannot be applied; empty where it can.")


class AxisPoint(ResponseModel):
    """What a version leaves on one axis: a line over the rate."""

    bias_dps: float
    u_bias_dps: float
    scale_factor: float | None = Field(description="Left error over rate; null: there was one rate.")
    u_scale_factor: float | None


class Drift(ResponseModel):
    """A straight line through the figures of the recordings; repeatability from day to day is its noise."""

    axis: str = Field(description="x, y or z; 'all': the RMS error over all axes.")
    what: str = Field(description="bias, scale_factor or error.")
    unit: str
    points: int
    per_year: float
    u: float | None = Field(description="Standard uncertainty; null: it takes three recordings.")
    low: float | None = Field(description="95 %, by Student's t, from.")
    high: float | None
    repeatability: float | None = Field(description="Standard deviation from recording to recording.")
    significant: bool = Field(description="Whether 0 is outside the interval.")
    line: DriftLine = Field(description="The line, for a picture.")


class DriftLine(ResponseModel):
    """A straight line over time with its 95 % interval, from the first recording on and into the time after the last;
    lists of equal length."""

    at: list[datetime]
    value: list[float] = Field(description="In the unit of the figure: deg/s, or a share.")
    low: list[float | None] = Field(description="95 %, by Student's t, from; null: it takes three recordings.")
    high: list[float | None]


class Leaving(ResponseModel):
    """When the bias of an axis leaves the limit; null: not within 50 years, or not known."""

    axis: str
    outside: bool = Field(description="Whether the line is outside the limit at the newest recording already.")
    expected: datetime | None
    earliest: datetime | None
    latest: datetime | None


class TrendResponse(ResponseModel):
    """A version compared with all recordings of its unit, in order of time."""

    serial: str
    version: int
    limit_dps: float | None
    points: list[TrendPoint]
    drifts: list[Drift]
    leaves: list[Leaving]
    text: list[str]


TrendPoint.model_rebuild()
Drift.model_rebuild()
