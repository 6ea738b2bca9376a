"""The ladder of a unit: the error, version by version."""

from __future__ import annotations

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.calibrations import FITTED_TO
from labctl.answers.common_fields import (
    EffectIds,
    FittedRms,
    HeldoutRms,
    ModelName,
    NoiseFloor,
    ParentVersion,
    RawRms,
    Serial,
    VersionNumber,
)


class LadderRow(ResponseModel):
    """One version of a unit's calibration, with its errors."""

    version: VersionNumber
    parent: ParentVersion
    recording: int | None = Field(description="The recording that the version was fitted to.")
    recordings: list[int] = Field(default_factory=list, description=FITTED_TO)
    model: ModelName
    effects: EffectIds
    applied_rms_dps: float | None = Field(
        default=None,
        description=(
            "RMS error on this recording alone without refitting, deg/s: of versions in `others` and, where there are "
            "others, of versions fitted to several recordings together."
        ),
    )
    raw_rms_dps: RawRms
    rms_dps: FittedRms
    heldout_rms_dps: HeldoutRms
    noise_floor_dps: NoiseFloor


class LadderResponse(ResponseModel):
    """The error of the versions fitted to one recording, each version after its parent."""

    serial: Serial
    recording: int | None = Field(default=None, description="Recording that all `steps` were fitted to.")
    recordings: list[int] = Field(default_factory=list, description="All recordings that `steps` were fitted to.")
    steps: list[LadderRow] = Field(description="Each version that was fitted to `recordings`.")
    others: list[LadderRow] = Field(
        default_factory=list, description="Versions fitted to other recordings, with their error on this recording."
    )
    noise_floor_dps: NoiseFloor
