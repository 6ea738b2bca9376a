"""The ladder of a unit: the error, version by version."""

from __future__ import annotations

from pydantic import Field

from labctl.services.schemas.base import ResponseModel
from labctl.services.schemas.calibrations import FITTED_TO


class LadderRow(ResponseModel):
    """One version of a unit's calibration, with its errors."""

    version: int
    parent: int | None
    recording: int | None = Field(description="The recording that the version was fitted to.")
    recordings: list[int] = Field(default_factory=list, description=FITTED_TO)
    model: str
    effects: list[str]
    applied_rms_dps: float | None = Field(
        default=None,
        description="Only for versions in `others`: RMS error on this recording without refitting, deg/s.",
    )
    raw_rms_dps: float | None
    rms_dps: float | None
    heldout_rms_dps: float | None
    noise_floor_dps: float | None


class LadderResponse(ResponseModel):
    """The error of the versions fitted to one recording, each version after its parent."""

    serial: str
    recording: int | None = Field(default=None, description="Recording that all `steps` were fitted to.")
    recordings: list[int] = Field(default_factory=list, description="All recordings that `steps` were fitted to.")
    steps: list[LadderRow]
    others: list[LadderRow] = Field(
        default_factory=list, description="Versions fitted to other recordings, with their error on this recording."
    )
    noise_floor_dps: float | None
