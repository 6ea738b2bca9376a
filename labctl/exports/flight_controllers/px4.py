"""PX4's thermal compensation: parameters TC_G*, as a file that QGroundControl loads.

PX4 subtracts X0 + X1 d + X2 d^2 + X3 d^3 (rad/s, float32) with d = clamp(T, TMIN, TMAX) - TREF from the output of the
sensor, before CAL_GYRO offsets and the rotation of sensor and board (TemperatureCompensation.cpp, Gyroscope.hpp).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.calibration import Calibration
from labctl.exports.comments import commented, head_lines
from labctl.exports.flight_controllers.bias_cubic import (
    AXES,
    COMMON_OPTIONS,
    ORDER,
    bias_cubic,
    compared,
    hold_tolerance,
)
from labctl.exports.format import Format, Loss, Written
from labctl.exports.options import whole_number
from labctl.fitting.numeric.arrays import Array

NAME, CONSUMER = "px4", "PX4"
#: MAVLink types of parameters.
FLOAT, INTEGER = 9, 6
#: PX4 computes a new offset when the temperature has moved by this, K.
UPDATE_K = 1.0


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the parameters; raises BadInput for a calibration without a bias over temperature in x, y and z."""
    instance = whole_number(options, "instance", (0, 3), 0, NAME)
    cubic = bias_cubic(calibration, NAME, CONSUMER, None)
    low, high = (np.float32(limit) for limit in calibration.temperature_c)
    reference = np.float32(cubic.reference_c)
    values = bias_cubic(calibration, NAME, CONSUMER, float(reference)).coefficients.astype(np.float32)

    def offset_rad_s(temperature_c: Array) -> Array:
        d = (np.clip(temperature_c.astype(np.float32), low, high) - reference)[:, None]
        squared = d * d
        return np.asarray(values[0] + values[1] * d + values[2] * squared + values[3] * squared * d, dtype=np.float64)

    differences_seen = compared(cubic, offset_rad_s)
    hold_tolerance(options, differences_seen, NAME)
    temperatures_c = cubic.part.temperatures()
    moved = np.rad2deg(offset_rad_s(temperatures_c + UPDATE_K) - offset_rad_s(temperatures_c))
    losses = (
        *cubic.losses(differences_seen, CONSUMER),
        Loss("a new offset is applied only when the temperature has moved by 1 K", float(np.abs(moved).max())),
    )
    prefix = f"TC_G{instance}_"
    rows = [("TC_G_ENABLE", "1", INTEGER)]
    if "device_id" in options:
        device = whole_number(options, "device_id", (1, 2**31 - 1), 1, NAME)
        rows.append((f"{prefix}ID", str(device), INTEGER))
    rows += [(f"{prefix}{name}", f"{value:.9g}", FLOAT) for name, value in
             (("TREF", reference), ("TMIN", low), ("TMAX", high))]  # fmt: skip
    rows += [
        (f"{prefix}X{power}_{column}", f"{values[power, column]:.9g}", FLOAT)
        for power in range(ORDER, -1, -1)
        for column in range(len(AXES))
    ]
    head = head_lines(
        calibration, "the bias over temperature, as a cubic in rad/s about TC_G*_TREF",
        float(differences_seen.at_rest.max()),
        losses, _notes(prefix, has_id="device_id" in options),
    )  # fmt: skip
    body = "".join(f"1\t1\t{name}\t{value}\t{kind}\n" for name, value, kind in rows)
    return Written((commented(head) + body).encode("ascii"), losses, float(differences_seen.at_rest.max()))


def _notes(prefix: str, *, has_id: bool) -> list[str]:
    """Return what a person has to know who loads the file."""
    notes = [
        "Axes are the sensor's own, as in its raw output, before the rotations of sensor and board.",
        (
            "This file contains the whole bias: set CAL_GYROn_XOFF, _YOFF and _ZOFF of this sensor to 0, or "
            "calibrate them anew."
        ),
        "Vehicle, component, parameter, value, type (6: integer, 9: float):",
    ]
    if not has_id:
        notes.insert(0, f"{prefix}ID is not in this file and must be the sensor's device id (option device_id): "
                        "PX4 uses the set only then.")  # fmt: skip
    return notes


FORMAT = Format(
    "PX4 parameters",
    "text/plain; charset=us-ascii",
    "params",
    write,
    {
        "device_id": "device id of the sensor, as in CAL_GYROn_ID; default: TC_Gn_ID is left out",
        "instance": "n of TC_Gn, 0 to 3; default 0",
        **COMMON_OPTIONS,
    },
)
