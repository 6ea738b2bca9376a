"""Calibration of an accelerometer."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from labctl.answers.base import ResponseModel
from labctl.answers.common_fields import Sentences
from labctl.answers.magnetometer import Estimate
from labctl.answers.poses import AlignmentJson


class EarlierVersion(ResponseModel):
    """An earlier version that a calibration by few poses rests on; its bias is not used."""

    version: int = Field(description="Number of that version of the accelerometer.")
    scale_change: float = Field(description="Allowed change of a scale factor since, standard uncertainty.")
    misalignment_change: float = Field(description="Allowed change of a misalignment since, standard uncertainty, rad.")
    p_value: float = Field(
        description="Of rests and earlier version together; below 0.01 they disagree, and the verdict is unexplained."
    )


class AccelerometerTemperature(ResponseModel):
    """Bias and scale factors as polynomials of the temperature about a reference; misalignments are constant."""

    reference_c: float = Field(description="Temperature at which the other parameters of the result hold, deg C.")
    range_c: tuple[float, float] = Field(description="Lowest and highest temperature of the rests, deg C.")
    temperatures: int = Field(description="Temperatures of the rests that are more than 2 K apart.")
    bias_g: dict[str, list[Estimate]] = Field(description="By axis, of T - reference to the power 1, 2, ...: g/K, ...")
    scale_factor: dict[str, list[Estimate]] = Field(description="The same of the scale factor, 1/K.")
    covariance: list[list[float]] = Field(
        description="Of the nine parameters at the reference, bias by power and axis, scale factor by power and axis."
    )
    constant_g: float = Field(description="What nine parameters without temperature leave of the used rests, RMS, g.")


class AccelerometerResponse(ResponseModel):
    """Nine parameters of an accelerometer: reading = bias + (1 + errors) force, by gravity in poses at rest."""

    verdict: Literal["adequate", "unexplained"] = Field(
        description="adequate: held-out rests are predicted to the noise of their means; unexplained: they are not, "
        "and the uncertainties include what is left."
    )
    bias_g: dict[str, Estimate] = Field(
        description="For each axis: bias in units of 9.80665 m/s2, with its standard uncertainty."
    )
    scale_factor: dict[str, Estimate] = Field(description="Relative errors of the scale factors, by axis.")
    misalignment: dict[str, Estimate] = Field(description="xy, xz, yz: of an axis by the force along another.")
    covariance: list[list[float]] = Field(description="Of bias x, y, z, scale factor x, y, z, misalignment xy, xz, yz.")
    gravity_g: float = Field(description="Local gravity, in units of 9.80665 m/s2.")
    rests: int = Field(description="Number of rests, also of those that were left out.")
    left_out: int = Field(description="Rests that do not agree with gravity by five standard deviations.")
    poses: int = Field(description="Different directions among the rests.")
    before_g: float = Field(description="Root mean square by which the raw sizes differ from gravity, g.")
    residual_g: float = Field(description="The same after the calibration, g.")
    heldout_g: float = Field(description="The same of rests predicted from all others, g.")
    expected_g: float = Field(description="What the noise of the means alone makes of it, g.")
    noise_density_m_s2: dict[str, float] = Field(description="White noise by axis, m/s2/sqrt(Hz), from the rests.")
    earlier: EarlierVersion | None = Field(
        default=None, description="Earlier version that was used too; null: the poses alone."
    )
    temperature: AccelerometerTemperature | None = Field(
        default=None, description="Over temperature; null: it was not asked for, and the parameters are constants."
    )
    alignment: AlignmentJson | None = Field(
        default=None,
        description="Rotation of the gyro triad from the accelerometer triad, deg; null: no gyro, rests and turns that "
        "do not determine it, or rests that do not agree with the earlier version: `text` says which.",
    )
    text: Sentences
