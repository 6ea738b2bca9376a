"""Units: who they are and what is known of them."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.base import Request, ResponseModel
from labctl.answers.common_fields import (
    TECHNOLOGY,
    BenchName,
    FormatTitle,
    MaxError,
    MeanError,
    ModelName,
    OutputAxis,
    PersonName,
    RecipeName,
    RecordingNumber,
    RmsError,
    Sentences,
    Serial,
    UnitModel,
    VersionNumber,
)
from labctl.answers.drafts import DraftResponse


class ExportFormatResponse(ResponseModel):
    """A format in which calibrations are available."""

    id: str = Field(description="Name of the format, to be sent as `format`.")
    title: FormatTitle
    suffix: str = Field(description="Suffix of a file in this format, without the dot.")
    options: dict[str, str] = Field(description="For each option of the format: its meaning, unit and default.")


class RecalibrationResponse(ResponseModel):
    """The campaign that the version in force is from: run again, it calibrates the unit again."""

    recipe: str = Field(description="Recipe of that campaign as TOML text, for `POST /api/campaigns`.")
    name: RecipeName
    bench: BenchName


class CalibrationEventResponse(ResponseModel):
    """A version of a unit that was made, or that was certified or revoked."""

    serial: Serial
    version: VersionNumber
    act: Literal["made", "certify", "revoke"] = Field(
        description="made: it was fitted, or changed from another version; certify, revoke: it was certified, or its "
        "certification revoked."
    )
    at: datetime = Field(description="Time of the event.")
    by: str = Field(description="Person who certified or revoked it; empty for a version that was made.")
    model: ModelName


UnitState = Literal["in_force", "overdue", "none"]


class VersionErrors(ResponseModel):
    """Errors of the newest versions of a unit over the noise floor, as lists of equal length."""

    version: list[int] = Field(description="Numbers of the versions, rising; at most the newest 24.")
    over_floor: list[float | None] = Field(
        description="RMS error of each version on the data it was fitted to, over the noise floor of these data; null: "
        "one of both is not known, or the floor is 0."
    )


class UnitResponse(ResponseModel):
    """A unit, its recordings and its calibrations."""

    serial: Serial
    model: UnitModel
    technology: str | None = Field(description=TECHNOLOGY)
    batch: str = Field(default="", description="Batch of the manufacturer; empty: not stated.")
    supplier: str = Field(default="", description="Supplier of the unit; empty: not stated.")
    axes: list[Literal["x", "y", "z"]] = Field(
        default_factory=list,
        description="Output axes of the newest recording; empty: there is no recording, or the response lists units.",
    )
    recordings: list[int] = Field(description="Numbers of the unit's recordings.")
    calibrations: list[int] = Field(description="Numbers of the unit's calibration versions.")
    newest_errors: VersionErrors = Field(description="Errors of the newest versions over the noise floor.")
    certified_version: int | None = Field(description="Number of the version in force; null: none.")
    certified_verdict: str | None = Field(
        default=None,
        description="Verdict with which the version in force was certified; null: no version is in force, or it was "
        "certified without a verdict.",
    )
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


#: Units of one request.
MAX_SERIALS = 10_000


class BatchRequest(Request):
    """State the batch of some units."""

    batch: str = Field(max_length=100, description="Batch of the manufacturer; empty: no batch is stated any more.")
    serials: list[Serial] = Field(min_length=1, max_length=MAX_SERIALS, description="Serial numbers of the units.")
    supplier: str | None = Field(
        default=None, max_length=200, description="Supplier of the units; null: what is stated stays."
    )
    by: PersonName


class BatchResponse(ResponseModel):
    """A batch of units."""

    batch: str = Field(description="Batch of the manufacturer; empty: of the units without one.")
    units: int = Field(description="Number of its units in the database.")


class AppliedVersion(ResponseModel):
    """A version applied to a recording without refitting."""

    version: VersionNumber
    rms_dps: RmsError
    max_dps: MaxError
    bias_dps: MeanError
    part: Literal["verification", "all"] = Field(
        description="verification: error of the data sets that were measured to verify; all: the recording has none."
    )


class AxisPoint(ResponseModel):
    """What a version leaves on one axis: a line over the rate."""

    bias_dps: float = Field(description="Remaining bias: error at rate 0, deg/s.")
    u_bias_dps: float = Field(
        description="Standard uncertainty of `bias_dps` due to the scatter about the line, deg/s."
    )
    scale_factor: float | None = Field(
        description="Remaining error divided by the rate (1 = 100 %); null: the recording has only one rate."
    )
    u_scale_factor: float | None = Field(
        description="Standard uncertainty of `scale_factor` due to the scatter about the line, 1; null: the "
        "recording has only one rate."
    )


class TrendPoint(ResponseModel):
    """One recording of the unit."""

    recording: RecordingNumber
    at: datetime = Field(description="Time of the measurement.")
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


class DriftLine(ResponseModel):
    """A straight line over time with its 95 % interval, from the first recording on and into the time after the last;
    lists of equal length."""

    at: list[datetime] = Field(description="Times of the points of the line.")
    value: list[float] = Field(
        description="Values of the line: deg/s for bias and error, a ratio for the scale factor."
    )
    low: list[float | None] = Field(
        description="Lower limit of the 95 % interval of the line, by Student's t; null "
        "with fewer than three recordings."
    )
    high: list[float | None] = Field(
        description="Upper limit of the 95 % interval of the line, by Student's t; null with fewer than three "
        "recordings."
    )


class Drift(ResponseModel):
    """A straight line through the figures of the recordings; repeatability from day to day is its noise."""

    axis: str = Field(description="x, y or z; `all` for the RMS error over all axes.")
    what: str = Field(description="The figure that changes with time: bias, scale_factor or error.")
    unit: str = Field(description="Unit of `per_year`: deg/s/year for bias and error, 1/year for the scale factor.")
    points: int = Field(description="Number of recordings that the line was fitted to.")
    per_year: float = Field(description="Slope of the line: change per year, in `unit`.")
    u: float | None = Field(description="Standard uncertainty of `per_year`; null with fewer than three recordings.")
    low: float | None = Field(
        description="Lower limit of the 95 % interval of `per_year`, by Student's t; null with "
        "fewer than three recordings."
    )
    high: float | None = Field(
        description="Upper limit of the 95 % interval of `per_year`, by Student's t; null with fewer than three "
        "recordings."
    )
    repeatability: float | None = Field(
        description="Standard deviation of the recordings about the line; null with fewer than three recordings."
    )
    significant: bool = Field(description="Whether 0 is outside the 95 % interval of `per_year`.")
    line: DriftLine = Field(description="Points of the straight line through the figures, for drawing.")


class Leaving(ResponseModel):
    """When the bias of an axis leaves the limit."""

    axis: OutputAxis
    outside: bool = Field(
        description="Whether the fitted line is already outside the limit at the time of the newest recording."
    )
    expected: datetime | None = Field(
        description="Time at which the fitted line leaves the limit; null: not within 50 years, or not known."
    )
    earliest: datetime | None = Field(
        description="Earliest such time by the 95 % interval of the line; null: not within 50 years, or not known."
    )
    latest: datetime | None = Field(
        description="Latest such time by the 95 % interval of the line; null: not within 50 years, or not known."
    )


class TrendResponse(ResponseModel):
    """A version compared with all recordings of its unit, in order of time."""

    serial: Serial
    version: VersionNumber
    limit_dps: float | None = Field(
        description="Limit of the magnitude of the bias, deg/s: as requested, else twice the error that the "
        "version states; null: not known."
    )
    points: list[TrendPoint] = Field(description="Each recording of the unit whose date is known, in order of time.")
    drifts: list[Drift] = Field(
        description="A line over time for each figure; empty: fewer than two occasions were measured."
    )
    leaves: list[Leaving] = Field(
        description="For each axis: when its bias leaves `limit_dps`; empty: there is no line or no limit."
    )
    undated: list[int] = Field(
        default_factory=list, description="Recordings whose date of measurement is not known; they are left out."
    )
    text: Sentences


TrendPoint.model_rebuild()
Drift.model_rebuild()
