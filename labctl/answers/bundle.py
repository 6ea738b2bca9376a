"""A bundle of calibrations that was written."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import FileName


class BundleResponse(ResponseModel):
    """A bundle of calibrations for vehicles without a network."""

    file: FileName
    model: str | None = Field(description="Model of the units in the bundle; null: units of every model.")
    calibrations: int = Field(description="How many units have a calibration in the bundle.")
    withdrawn: int = Field(description="How many units are named without one, because their version was withdrawn.")
    bytes: int = Field(description="Size of the file, bytes.")
    sha256: str = Field(description="SHA-256 of the file, 64 hexadecimal digits.")
    made_at: datetime = Field(description="Time at which the bundle was made.")
    expires_at: datetime | None = Field(
        description="Time from which the bundle is refused by what reads it; null: it has no such time."
    )
    signed_by: str | None = Field(
        description="Fingerprint of the seal key, SHA-256 of its public key; null: the bundle has no signature."
    )
