"""The answer of a live calibration."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.calibrations import FitResponse


class LiveCoefficientResponse(ResponseModel):
    """One coefficient at the end of a live calibration."""

    axis: str
    name: str
    value: float
    expanded: float = Field(description="Expanded uncertainty U with k = 2, in `unit`.")
    unit: str
    limit: float | None = Field(description="Limit of U by the target; null: the target states none.")


class LiveResponse(ResponseModel):
    """Result of `labctl live`: what was measured, what it determines, and what is missing."""

    serial: str
    complete: bool = Field(description="Whether the target was reached.")
    ended: Literal["complete", "stream", "interrupted"] = Field(
        description="Why it ended: the target was reached, the stream ended or failed, or the person ended it."
    )
    text: str = Field(description="Why it ended, in words.")
    recording: int = Field(description="Number of the recording, which holds every reading.")
    readings: int
    lost: int = Field(description="Readings that are missing by the instrument's counter or by the clock.")
    damaged: int = Field(description="Lines or frames of the stream that could not be read.")
    duration_s: float
    rests: int
    poses: list[str] = Field(description="Asked poses that rests cover, by the body axes that point up.")
    poses_asked: int
    coefficients: list[LiveCoefficientResponse] = Field(
        description="By the fit to all readings; empty where they do not allow one."
    )
    missing: list[str] = Field(description="What is missing, in words; empty when the calibration is complete.")
    left_out: list[str] = Field(description="Turns that the fit could not use, and why.")
    fit: FitResponse | None = Field(
        description="The new calibration version; null: the calibration is not complete, or the fit was refused."
    )
    refused: str = Field(default="", description="Why the complete calibration was not kept as a version.")
