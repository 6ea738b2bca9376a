"""Drafts: the calibrations that campaigns end in."""

from __future__ import annotations

from datetime import datetime
from typing import Literal

from pydantic import Field

from labctl.answers.base import Request, ResponseModel
from labctl.answers.certification import (
    CertifiedErrors,
)
from labctl.answers.common_fields import (
    CampaignNumber,
    CoefficientName,
    CoefficientUnit,
    MaxError,
    MeanError,
    ModelName,
    OutputAxis,
    RecordingNumber,
    RmsError,
    Serial,
    VersionNumber,
)
from labctl.answers.judgement import Objection
from labctl.answers.verification import AxisVerification


class DraftsRequest(Request):
    """Which drafts of a campaign to make now."""

    again: bool = Field(default=False, description="Also try again the drafts that failed before.")


class ComparedModel(ResponseModel):
    """A model fitted to the recording of a draft; only the draft's own is kept as a version."""

    model: ModelName
    error: CertifiedErrors | None = Field(
        description="Errors of the model, deg/s; null: the model could not be fitted, see `why`."
    )
    why: str = Field(default="", description="Why the model could not be fitted; else empty.")


class RemainingLine(ResponseModel):
    """Straight line over the rate through the error that a version leaves on one axis, by least squares."""

    bias_dps: float = Field(description="Remaining bias: error at rate 0, deg/s.")
    u_bias_dps: float = Field(
        description="Standard uncertainty of `bias_dps` due to the scatter about the line, deg/s."
    )
    scale_factor: float | None = Field(
        description="Scale factor error: slope of the error over the rate (1 = 100 %); null: the recording has only "
        "one rate."
    )
    u_scale_factor: float | None = Field(
        description="Standard uncertainty of `scale_factor` due to the scatter about the line, 1; null: the "
        "recording has only one rate."
    )


class AppliedDraft(ResponseModel):
    """A version applied to the recording of a draft as it is, nothing refitted. Errors: corrected minus true rate."""

    version: VersionNumber
    rms_dps: RmsError
    max_dps: MaxError
    bias_dps: MeanError
    axes: dict[str, AxisVerification] = Field(
        description="For each axis: its error, what is expected of it, and its limit."
    )
    expected_dps: float | None = Field(description="RMS error that is expected of the version, deg/s; null: unknown.")
    ok: bool = Field(description="Whether the RMS error of each axis is at most the limit of the axis.")
    lines: dict[str, RemainingLine] = Field(
        default_factory=dict, description="For each axis: bias and scale factor error that the version leaves."
    )


class CoefficientChange(ResponseModel):
    """One coefficient of the draft beside the same of the version in force."""

    axis: OutputAxis
    coefficient: CoefficientName
    temperature_c: float | None = Field(description="Node of a temperature table, deg C; null: there is no table.")
    in_force: float = Field(description="Value in the version in force, in `unit`.")
    draft: float = Field(description="Value in the draft, in `unit`.")
    change: float = Field(description="`draft` minus `in_force`, in `unit`.")
    u: float | None = Field(description="Standard uncertainty of `change`: root sum of squares; null: unknown.")
    unit: CoefficientUnit
    significant: bool | None = Field(description="Whether |change| is larger than 2 u; null: u is unknown.")


class DriftFromVersion(ResponseModel):
    """The draft against the version that was in force."""

    version: int = Field(description="The version that was in force when the draft was made.")
    largest_dps: dict[str, float] = Field(
        description="For each axis: largest difference of the corrected rates at any data set of the recording, deg/s."
    )
    rms_dps: dict[str, float] = Field(description="For each axis: root mean square of that difference, deg/s.")
    coefficients: list[CoefficientChange] = Field(
        description="Change of each coefficient; empty: the two models differ, see `why`."
    )
    why: str = Field(default="", description="Why the coefficients were not compared; else empty.")


class LimitResult(ResponseModel):
    """A figure of the draft against a limit of the recipe: it passes if it is at most the limit (simple acceptance)."""

    limit: Literal["heldout_rms_dps", "max_error_dps", "drift_dps"] = Field(
        description="Name of the limit in the recipe."
    )
    axis: str | None = Field(description="Axis of the figure; null: all axes together.")
    value_dps: float | None = Field(
        description="Figure that is compared with the limit, deg/s; null: not known, see `why`."
    )
    at_most_dps: float = Field(description="Limit of the recipe, deg/s.")
    passed: bool | None = Field(
        description="Whether the limit is kept; null: not decided, because the figure is not known."
    )
    why: str = Field(default="", description="Why the figure is not known; else empty.")


class DraftReport(ResponseModel):
    """What is known of a draft when it is made."""

    model: ModelName
    error: CertifiedErrors = Field(description="Errors that the draft states, deg/s.")
    compared: list[ComparedModel] = Field(description="The draft's model first, then those of the recipe.")
    smallest_heldout: str | None = Field(
        description="Model with the smallest held-out error, or the first that is listed of those whose errors are not "
        "clearly larger; null: no model has a held-out error."
    )
    verdict: str | None = Field(description="Verdict of the criticism on the recording; null: see `verdict_reason`.")
    verdict_text: str = Field(description="The verdict in words; empty: there is none.")
    verdict_reason: str = Field(description="Why there is no verdict; else empty.")
    objections: list[Objection] = Field(description="Objections to a certification of the draft.")
    as_found: AppliedDraft | None = Field(
        description="Errors of the recording corrected by the version in force; null: see `as_found_why`."
    )
    as_found_why: str = Field(default="", description="Why `as_found` is null; else empty.")
    as_left: AppliedDraft | None = Field(
        description="Errors of the recording corrected by the draft; null: the "
        "draft cannot be applied, see `as_left_why`."
    )
    as_left_why: str = Field(default="", description="Why `as_left` is null; else empty.")
    drift: DriftFromVersion | None = Field(
        description="Difference between the draft and the version in force; "
        "null: no version was in force, or the recipe does not request it."
    )
    limits: list[LimitResult] = Field(description="The figures that the recipe limits; empty: it limits none.")
    within_limits: bool | None = Field(
        description="Whether all limits of the recipe are kept; null: the recipe has no limits, or a figure is "
        "not known."
    )
    text: str = Field(description="The report in one paragraph.")


class DraftResponse(ResponseModel):
    """The draft of one recording of a campaign."""

    serial: Serial
    campaign: CampaignNumber
    recording: RecordingNumber
    state: Literal["due", "fitted", "made", "failed"] = Field(
        description="due: the draft will be made when the campaign is done; fitted: the version is stored, its "
        "report is not; made: both are stored; failed: see `reason`."
    )
    version: int | None = Field(description="Version number of the draft; null: no version was made.")
    certified: bool = Field(default=False, description="Whether this version is in force now.")
    at: datetime | None = Field(description="Time at which the draft was made, or failed.")
    reason: str = Field(description="Why the draft failed, and what to do; else empty.")
    report: DraftReport | None = Field(default=None, description="What is known of the draft; null: it is not made.")


class DraftsResponse(ResponseModel):
    """The drafts of a campaign."""

    campaign: CampaignNumber
    drafts: list[DraftResponse] = Field(
        description="The drafts (proposed calibrations), one per recording; empty: the recipe has no [fit]."
    )
