"""Gyro and accelerometer triads by poses, where more than these poses tells the accelerometer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.answers.accelerometer import AccelerometerResponse, EarlierVersion
from labctl.errors import BadInput, NotEnoughData
from labctl.fitting.poses.at_rest.accelerometer import MIN_POSES, PARAMETERS
from labctl.fitting.poses.at_rest.fewer_poses import DISAGREE, FREE, ByFewer, Known, Scatter, by_fewer_poses
from labctl.fitting.poses.at_rest.rests import Rests, find_rests
from labctl.fitting.poses.at_rest.temperature import OverTemperature, at_reference, calibrate_over_temperature
from labctl.fitting.poses.fit import Solved, solve
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import UPPER


@dataclass(frozen=True)
class Earlier:
    """An earlier version of the same accelerometer, and by how much it may have changed since."""

    version: int
    result: AccelerometerResponse
    scale_change: float = 1e-3  #: standard uncertainty
    misalignment_change: float = 5e-4  #: standard uncertainty, rad

    def known(self) -> Known:
        """Return what it tells of the parameters now. Raises BadInput for a change that is not positive."""
        for option, value in (
            ("--scale-change", self.scale_change),
            ("--misalignment-change", self.misalignment_change),
        ):
            if not 0 < value <= 1:
                raise BadInput(f"{option} {value:g}: give a standard uncertainty above 0 and up to 1, such as 0.001")
        was = self.result
        values = [was.scale_factor[a].value for a in AXES]
        values += [was.misalignment[AXES[i] + AXES[j]].value for i, j in UPPER[3:]]
        changes = np.repeat([self.scale_change, self.misalignment_change], 3)
        return Known(
            np.array(values), np.array(was.covariance)[3:, 3:] + np.diag(changes**2),
            np.array([was.bias_g[a].value for a in AXES]), scatter_of(was),
        )  # fmt: skip

    def answer(self, p_value: float) -> EarlierVersion:
        """Return what the response says of it."""
        return EarlierVersion(
            version=self.version, scale_change=self.scale_change, misalignment_change=self.misalignment_change,
            p_value=p_value,
        )  # fmt: skip

    def text(self, fewer: ByFewer) -> str:
        """Return a sentence on what it contributes, and whether the rests agree with it."""
        used = (
            f"Scale factors and misalignments rest on version {self.version} too, with a change since of "
            f"{self.scale_change:g} and {self.misalignment_change:g} (standard uncertainty)"
        )
        if fewer.agrees:
            return f"{used}; the rests agree with it (p = {fewer.p_value:.2g})."
        return (
            f"{used}; the rests do NOT agree with it (p = {fewer.p_value:.1g}): the unit changed by more, or moved in "
            "its rests; lay it down in at least 12 poses and calibrate it without the earlier version."
        )


def scatter_of(was: AccelerometerResponse) -> Scatter | None:
    """Return how the sizes scattered in the rests of a calibration; None where no rest was more than its parameters."""
    used = was.rests - was.left_out
    of_temperature = 0 if was.temperature is None else len(was.temperature.covariance) - PARAMETERS
    freedom = used - (FREE if was.earlier else PARAMETERS + of_temperature)
    if freedom < 1:
        return None
    variance = was.residual_g**2 * used / freedom
    return Scatter(variance, variance * min(was.expected_g / max(was.heldout_g, 1e-12), 1.0) ** 2, freedom)


def require_one(temperature: str | None, earlier: Earlier | None) -> None:
    """Raise BadInput for a fit over temperature that is to use an earlier version too."""
    if temperature is not None and earlier is not None:
        raise BadInput("--temperature with --earlier: coefficients of temperature need all poses; leave one out")


def solved_of(readings: PoseReadings, earlier: Earlier | None, *, over_temperature: bool) -> Solved:
    """Return the calibration of both triads by readings in poses, and by an earlier version where one is given.

    Raises NotEnoughData where rests and turns do not determine it, or do not agree with that version.
    """
    if over_temperature:
        rests = find_rests(readings)
        return solve_even(readings, rests, calibrate_over_temperature(readings, rests))
    if earlier is not None:
        rests = find_rests(readings)
        return solve_with_earlier(readings, rests, earlier, by_fewer_poses(readings, rests, earlier.known()))
    return solve(readings)


def solve_even(readings: PoseReadings, rests: Rests, over_temperature: OverTemperature) -> Solved:
    """Return the calibration of both triads by an accelerometer over temperature. Raises NotEnoughData as `solve`.

    What a gyro's scale factors change with the temperature is scatter of the turns, and in the uncertainty by that.
    """
    even, means = at_reference(readings, rests, over_temperature)
    return solve(even, (means, over_temperature.reference))


def solve_with_earlier(readings: PoseReadings, rests: Rests, earlier: Earlier, fewer: ByFewer) -> Solved:
    """Return the calibration of both triads by an accelerometer with an earlier version.

    Raises NotEnoughData as `solve`, and for rests that do not agree with that version.
    """
    if not fewer.agrees:
        raise NotEnoughData(
            f"{readings.info.serial}: the rests do not agree with version {earlier.version} of the accelerometer (p = "
            f"{fewer.p_value:.1g}, limit {DISAGREE:g}), by which the turns are compared; lay the unit down in at least "
            f"{MIN_POSES} poses and calibrate it without the earlier version"
        )
    return solve(readings, (rests, fewer.accelerometer))
