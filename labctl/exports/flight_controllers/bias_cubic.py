"""The bias over temperature as a cubic: all that a flight controller's thermal calibration of a gyro carries."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev, polynomial

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.format import Loss
from labctl.exports.options import number
from labctl.exports.static_part import Differences, StaticPart, differences, needs_thermometer, static_part
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.rounding import at_most

ORDER = 3
#: Chebyshev nodes through which the cubic goes by least squares: nearly the best one for the largest error.
NODES = 64
AXES = ("x", "y", "z")
TOLERANCE = "tolerance_dps"
#: Options that both controllers' formats have.
COMMON_OPTIONS = {
    TOLERANCE: "largest part of the correction that may be lost, deg/s; default: no limit, and "
    "labctl reports what is lost"
}


@dataclass(frozen=True)
class BiasCubic:
    """Coefficients (4, 3 axes), rad/s and K, ascending, about a reference temperature, for x, y and z."""

    part: StaticPart
    coefficients: Array
    reference_c: float

    def losses(self, seen_differences: Differences, consumer: str) -> tuple[Loss, ...]:
        """Return what a bias alone loses of the calibration."""
        if not self.part.has_rates:
            return (Loss("scale factor and misalignment are not in this calibration"), *self.part.losses())
        slow, fast = self.part.calibration.rate_dps
        over = f"over {slow:g} to {fast:g} deg/s"
        return (
            Loss(
                f"scale factor and its nonlinearity, {over} ({consumer} has no parameter for them)",
                float(seen_differences.turning.max()),
            ),
            Loss(
                f"misalignment, {over} of the other axes ({consumer} has no parameter for it)",
                float(seen_differences.cross.max()),
            ),
            Loss("both together, bias included", seen_differences.together),
            *self.part.losses(),
        )


def bias_cubic(calibration: Calibration, format_name: str, consumer: str, reference_c: float | None) -> BiasCubic:
    """Return the cubic nearest to a calibration's bias; raises BadInput for a calibration without one.

    `reference_c` None: the middle of the calibrated temperatures.
    """
    missing = [axis for axis in AXES if axis not in calibration.axes]
    if missing:
        raise BadInput(
            f"format {format_name}: {calibration.serial} is calibrated along {', '.join(calibration.axes)} alone; "
            f"{consumer} needs x, y and z over one range of temperatures; measure {', '.join(missing)} too, or "
            "use format c or json"
        )
    needs_thermometer(
        calibration, format_name, f"a bias that is the same at every temperature needs no {consumer} thermal parameters"
    )
    part = static_part(calibration, format_name, carries=f"{consumer} corrects by the temperature only")
    low, high = calibration.temperature_c
    if not high > low:
        raise BadInput(
            f"format {format_name}: {calibration.serial} is calibrated at one temperature, {low:g} deg C, but "
            "this format describes the bias over temperature; use format c or json"
        )
    middle, half = (low + high) / 2, (high - low) / 2
    at = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    order = [calibration.axes.index(axis) for axis in AXES]
    bias = np.deg2rad(part.bias_dps(middle + half * at)[:, order])
    reference = middle if reference_c is None else reference_c
    shift = np.array([(reference - middle) / half, 1.0 / half])
    columns = []
    for series in chebyshev.chebfit(at, bias, ORDER).T:
        total = np.zeros(1)
        for coefficient in chebyshev.cheb2poly(series)[::-1]:
            total = polynomial.polyadd(polynomial.polymul(total, shift), [coefficient])
        columns.append(np.pad(total, (0, ORDER + 1))[: ORDER + 1])
    return BiasCubic(part, np.column_stack(columns), reference)


def compared(cubic: BiasCubic, offset_rad_s: Callable[[Array], Array]) -> Differences:
    """Compare the rate after a consumer's offset, (n, 3) rad/s for x, y, z at temperatures (n,), with a calibration."""
    order = [AXES.index(axis) for axis in cubic.part.axes]
    return differences(cubic.part, lambda raw, temperature_c: raw - np.rad2deg(offset_rad_s(temperature_c))[:, order])


def hold_tolerance(options: Mapping[str, str], seen_differences: Differences, format_name: str) -> None:
    """Raise BadInput where more is lost than the user accepts."""
    limit = number(options, TOLERANCE, format_name)
    if limit is not None and seen_differences.together > limit:
        raise BadInput(
            f"format {format_name}: up to {at_most(seen_differences.together):.3g} deg/s of the correction would be "
            "lost (scale "
            f"factor {at_most(float(seen_differences.turning.max())):.3g}, misalignment "
            f"{at_most(float(seen_differences.cross.max())):.3g} deg/s), "
            f"more than option {TOLERANCE} = {limit:g} deg/s allows; use format c or json, or raise {TOLERANCE}"
        )
