"""Units: who they are and what is known of them."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.reports.drafts import DraftResponse


class ExportFormatResponse(ResponseModel):
    """A format in which calibrations are available."""

    id: str = Field(description="Name of the format, to be sent as `format`.")
    title: str
    suffix: str = Field(description="Suffix of a file in this format, without the dot.")
    options: dict[str, str] = Field(description="For each option of the format: its meaning, unit and default.")


class RecalibrationResponse(ResponseModel):
    """The campaign that the version in force is from: run again, it calibrates the unit again."""

    recipe: str = Field(description="Recipe of that campaign as TOML text, for `POST /api/campaigns`.")
    name: str
    bench: str


class UnitResponse(ResponseModel):
    """A unit, its recordings and its calibrations."""

    serial: str
    model: str
    technology: str | None
    recordings: list[int]
    calibrations: list[int]
    certified_version: int | None
    due: datetime | None = Field(
        default=None,
        description="Time until which the version in force is valid; null: no due date, or no version is in force.",
    )
    overdue: bool = Field(default=False, description="Whether the date in `due` has passed.")
    notices: list[str] = Field(
        default_factory=list,
        description="Reference standards that were found bad on the days of the measurements behind the version in "
        "force.",
    )
    recalibration: RecalibrationResponse | None = Field(
        default=None,
        description="How to recalibrate the unit: the campaign behind the version in force, and its recipe; "
        "null: that version is not from a campaign, or the response lists units without `due_within`.",
    )
    draft: DraftResponse | None = Field(
        default=None,
        description="Newest draft calibration of the unit; null: there is none, or the response lists units "
        "without `due_within`.",
    )
    formats: list[ExportFormatResponse] = Field(description="Formats in which the unit's calibrations are available.")


class AppliedVersion(ResponseModel):
    """A version applied to a recording without refitting."""

    version: int
    rms_dps: float
    max_dps: float
    bias_dps: float
    part: Literal["verification", "all"] = Field(
        description="verification: error of the data sets that were measured to verify; all: the recording has none."
    )


class TrendPoint(ResponseModel):
    """One recording of the unit."""

    recording: int
    at: datetime
    as_found: AppliedVersion | None = Field(
        description="RMS error on this recording, deg/s, of the newest version that was fitted only to recordings made "
        "before it; null: there is no such version, or it cannot be applied to this recording."
    )
    as_left: AppliedVersion | None = Field(
        description="RMS error on this recording, deg/s, of the newest version that was fitted to it; null: there is "
        "no such version, or it cannot be applied."
    )
    rms_dps: float | None = Field(
        description="RMS error of the version that the trend compares with all recordings, "
        "deg/s; null: that version cannot be applied, see `why`."
    )
    axes: dict[str, AxisPoint] = Field(
        description="For each axis: bias and scale factor error that remain with the version that the trend compares."
    )
    why: str = Field(default="", description="Why the version cannot be applied to this recording; else empty.")


class AxisPoint(ResponseModel):
    """What a version leaves on one axis: a line over the rate."""

    bias_dps: float
    u_bias_dps: float
    scale_factor: float | None = Field(
        description="Remaining error divided by the rate (1 = 100 %); null: the recording has only one rate."
    )
    u_scale_factor: float | None


class Drift(ResponseModel):
    """A straight line through the figures of the recordings; repeatability from day to day is its noise."""

    axis: str = Field(description="x, y or z; `all` for the RMS error over all axes.")
    what: str = Field(description="The figure that changes with time: bias, scale_factor or error.")
    unit: str
    points: int
    per_year: float
    u: float | None = Field(description="Standard uncertainty of `per_year`; null with fewer than three recordings.")
    low: float | None = Field(
        description="Lower limit of the 95 % interval of `per_year`, by Student's t; null with "
        "fewer than three recordings."
    )
    high: float | None
    repeatability: float | None = Field(
        description="Standard deviation of the recordings about the line; null with fewer than three recordings."
    )
    significant: bool = Field(description="Whether 0 is outside the 95 % interval of `per_year`.")
    line: DriftLine = Field(description="Points of the straight line through the figures, for drawing.")


class DriftLine(ResponseModel):
    """A straight line over time with its 95 % interval, from the first recording on and into the time after the last;
    lists of equal length."""

    at: list[datetime]
    value: list[float] = Field(
        description="Values of the line: deg/s for bias and error, a ratio for the scale factor."
    )
    low: list[float | None] = Field(
        description="Lower limit of the 95 % interval of the line, by Student's t; null "
        "with fewer than three recordings."
    )
    high: list[float | None]


class Leaving(ResponseModel):
    """When the bias of an axis leaves the limit; null: not within 50 years, or not known."""

    axis: str
    outside: bool = Field(
        description="Whether the fitted line is already outside the limit at the time of the newest recording."
    )
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
    undated: list[int] = Field(
        default_factory=list, description="Recordings whose date of measurement is not known; they are left out."
    )
    text: list[str]


TrendPoint.model_rebuild()
Drift.model_rebuild()
