"""Noise of a gyro's axes for formats that carry nothing else: as options, or from the unit's Allan deviation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.fitting.numeric.arrays import Array

WHITE, WALK, RATE = "noise_dps_rthz", "walk_dps_s_rthz", "rate_hz"
FROM_ALLAN = "default: from the unit's Allan deviation; one number, or one for each axis with commas"
OPTIONS = {
    WHITE: f"white noise N, deg/s/sqrt(Hz); {FROM_ALLAN}",
    WALK: f"rate random walk K, deg/s^2/sqrt(Hz); {FROM_ALLAN}",
    RATE: "rate of the readings, Hz; default: that of the readings the Allan deviation is of",
}
#: deg/sqrt(h) in deg/s/sqrt(Hz), and deg/h/sqrt(h) in deg/s^2/sqrt(Hz).
DPS_RTHZ_PER_DEG_RTH, DPS_S_RTHZ_PER_DEG_H_RTH = 1 / 60, 1 / 216_000


@dataclass(frozen=True)
class AxisNoise:
    """White noise, rad/s/sqrt(Hz), and random walk, rad/s^2/sqrt(Hz), of each axis (axes,), None where unknown."""

    white: Array
    walk: Array | None
    rate_hz: float


def noise_of(calibration: Calibration, options: Mapping[str, str], format_name: str) -> AxisNoise:
    """Return the noise; raises BadInput where it or the rate of the readings is not known."""
    white, walk = (_positive(calibration, options, name, format_name) for name in (WHITE, WALK))
    rate = _positive(calibration, options, RATE, format_name)
    for name, noise in ((WHITE, white), (RATE, rate)):
        if noise is None:
            raise BadInput(
                f"format {format_name}: {name} of {calibration.serial} is not known ({OPTIONS[name].split(';')[0]}); "
                f"record the unit at rest, or give option {name}"
            )
    assert white is not None
    assert rate is not None
    return AxisNoise(np.deg2rad(white), None if walk is None else np.deg2rad(walk), float(rate[0]))


def _positive(calibration: Calibration, options: Mapping[str, str], name: str, format_name: str) -> Array | None:
    if name not in options:
        return None
    axes = len(calibration.axes)
    try:
        numbers = np.array([float(word) for word in options[name].split(",")])
    except ValueError:
        numbers = np.zeros(0)
    if len(numbers) not in {1, axes} or not np.all(np.isfinite(numbers) & (numbers > 0)):
        raise BadInput(
            f"format {format_name}: option {name} = {options[name]!r}: give a number above 0, or {axes} of them with "
            f"commas, one for each of {', '.join(calibration.axes)}"
        )
    return np.asarray(np.broadcast_to(numbers, (axes,)))
