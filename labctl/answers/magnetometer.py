"""Calibration of a magnetometer."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import Sentences
from labctl.answers.poses import FieldAlignmentJson


class Estimate(ResponseModel):
    """A value with its standard uncertainty."""

    value: float = Field(description="Value, in the unit that the field of this estimate states.")
    u: float | None = Field(description="Standard uncertainty; null: the value was given.")
    degrees_of_freedom: float | None = Field(
        default=None, gt=0,
        description="Degrees of freedom nu of `u`: U = t(95.45 %, nu) u, t of Student; null: not stated, U = 2 u.",
    )  # fmt: skip


class MagnetometerResponse(ResponseModel):
    """Hard and soft iron of a magnetometer: field = soft iron (reading - hard iron), in the axes of the sensor."""

    verdict: Literal["adequate", "unexplained"] = Field(
        description="adequate: the readings are those of a constant field up to their noise; unexplained: they are not."
    )
    hard_iron_ut: dict[str, Estimate] = Field(description="For each axis: hard iron, uT.")
    soft_iron: dict[str, Estimate] = Field(description="Symmetric matrix: xx, yy, zz, xy, xz, yz.")
    field_ut: Estimate = Field(description="Magnitude of the field, uT: given, or with a soft iron of determinant 1.")
    covariance: list[list[float]] = Field(
        description="Of hard iron x, y, z, soft iron xx, yy, zz, xy, xz, yz, and field."
    )
    readings: int = Field(description="Number of readings, also of those that were left out.")
    left_out: int = Field(description="Readings further from the ellipsoid than five robust standard deviations.")
    before_ut: float = Field(description="Standard deviation of the size of the raw readings, uT.")
    residual_ut: float = Field(description="Root mean square of the distances from the ellipsoid, uT.")
    heldout_ut: float = Field(description="The same of readings predicted from those of other times, uT.")
    noise_ut: float = Field(description="Noise of the distances from one reading to the next, uT.")
    repetition: float = Field(
        description="Readings that tell as much as one independent reading, by the autocorrelation of the distances; "
        "where no rests are known, the covariance includes it."
    )
    heading_error_deg: float = Field(description="Angle to which the held-out error turns a field square to it, deg.")
    largest_gap_deg: float = Field(description="From any direction to the nearest that was measured, at most, deg.")
    alignment: FieldAlignmentJson | None = Field(
        default=None,
        description="Rotation of the axes of the corrected field from those of the corrected force and rate, deg, and "
        "the dip of the field; null: no recording in poses, or rests and turns that do not determine it.",
    )
    text: Sentences
