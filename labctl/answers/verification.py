"""A version applied to a recording as it is, and the limits of its error."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import (
    MaxError,
    MeanError,
    RecordingNumber,
    RmsError,
    Serial,
    VersionNumber,
)


class AxisVerification(ResponseModel):
    """Corrected minus true rate of one axis over the data sets, deg/s."""

    rms_dps: RmsError
    max_dps: MaxError
    bias_dps: MeanError
    expected_dps: float | None = Field(
        default=None,
        description="RMS error that is expected of the version on this axis, deg/s: that over all axes times the share "
        "of the axis in what the version leaves of its own data; null: unknown.",
    )
    limit_dps: float | None = Field(
        default=None,
        description="Largest RMS error of an axis that holds, deg/s: twice `expected_dps`, or more where the "
        "recording or the data of the fit have few independent errors. In at most 5 % of the recordings of versions "
        "that hold is any axis beyond its limit.",
    )
    ok: bool | None = Field(default=None, description="Whether `rms_dps` is at most `limit_dps`; null: unknown.")


class VerificationResponse(ResponseModel):
    """A calibration version applied without refitting to a recording, nothing fitted. Errors: corrected minus true
    rate."""

    serial: Serial
    version: VersionNumber
    recording: RecordingNumber
    recorded_unit: str = Field(description="Serial number of the unit that was recorded.")
    seen: bool = Field(description="Whether the version was fitted to these data sets.")
    part: Literal["verification", "all"] = Field(
        description="verification: the data sets of the recording that were measured to verify, and are never fitted; "
        "all: the recording has none, so every data set."
    )
    datasets: int = Field(description="Number of data sets to which the version was applied.")
    rms_dps: RmsError
    max_dps: MaxError
    bias_dps: MeanError
    axes: dict[str, AxisVerification] = Field(
        description="For each axis: its error, what is expected of it, and its limit."
    )
    axes_off: list[str] = Field(
        default_factory=list, description="Axes whose RMS error is beyond the limit of the axis."
    )
    outside_validity: int = Field(
        description="Number of data sets outside the rates or temperatures of the calibration."
    )
    expected_dps: float | None = Field(
        description="RMS error that is expected of the version, deg/s: the larger of its held-out error and its "
        "error on the data of the fit; null: unknown."
    )
    ok: bool = Field(description="Whether the RMS error of each axis is at most the limit of the axis.")
