"""ArduPilot's thermal calibration: parameters INS_TCAL*, as a file of lines NAME,value.

ArduPilot (4.1 and later) subtracts P(T - 35) - P(CALTEMP - 35) and then GYROFFS, with P(d) = (c1 d + c2 d^2 + c3 d^3)
1e-6 rad/s in float32 and both temperatures clamped to TMIN and TMAX (AP_InertialSensor_tempcal.cpp).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.comments import commented, head_lines
from labctl.exports.flight_controllers.bias_cubic import AXES, COMMON_OPTIONS, bias_cubic, compared, hold_tolerance
from labctl.exports.format import Format, Written
from labctl.exports.options import whole_number
from labctl.fitting.numeric.arrays import Array

NAME, CONSUMER = "ardupilot", "ArduPilot"
REFERENCE_C, SCALE = 35.0, 1e6
#: Limits of TMIN and TMAX, deg C.
LIMITS_C = (-70.0, 80.0)
#: IMUs from this one on have names of their own form.
LATER_FORM = 4


def parameter_names(imu: int) -> tuple[str, str, str]:
    """Return the beginnings of the names of an IMU's thermal set and offsets, and the name of its CALTEMP."""
    if imu >= LATER_FORM:
        return f"INS{imu}_TCAL_", f"INS{imu}_GYROFFS_", f"INS{imu}_GYR_CALTEMP"
    return f"INS_TCAL{imu}_", f"INS_GYR{'' if imu == 1 else imu}OFFS_", f"INS_GYR{imu}_CALTEMP"


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the parameters; raises BadInput for a calibration without a bias over temperature in x, y and z."""
    imu = whole_number(options, "imu", (1, 5), 1, NAME)
    cubic = bias_cubic(calibration, NAME, CONSUMER, REFERENCE_C)
    low, high = calibration.temperature_c
    if low < LIMITS_C[0] or high > LIMITS_C[1]:
        raise BadInput(
            f"format {NAME}: {calibration.serial} is calibrated from {low:g} to {high:g} deg C; TMIN and TMAX "
            f"of ArduPilot go only from {LIMITS_C[0]:g} to {LIMITS_C[1]:g} deg C; use format c or json"
        )
    t_min, t_max = np.float32(low), np.float32(high)
    at_c = np.float32(min(max(REFERENCE_C, float(t_min)), float(t_max)))
    values = (cubic.coefficients[1:] * SCALE).astype(np.float32)

    def polynomial(temperature_c: Array) -> Array:
        d = (np.clip(temperature_c.astype(np.float32), t_min, t_max) - np.float32(REFERENCE_C))[:, None]
        return np.asarray((values[0] + (values[1] + values[2] * d) * d) * d * np.float32(1 / SCALE), dtype=np.float64)

    at_caltemp = polynomial(np.array([float(at_c)]))
    offsets = (cubic.coefficients[0] + at_caltemp[0]).astype(np.float32)
    differences_seen = compared(
        cubic, lambda temperatures_c: polynomial(temperatures_c) - at_caltemp + offsets.astype(np.float64)
    )
    hold_tolerance(options, differences_seen, NAME)
    losses = cubic.losses(differences_seen, CONSUMER)
    thermal, offset, caltemp = parameter_names(imu)
    rows = [(f"{thermal}ENABLE", "1"), (f"{thermal}TMIN", f"{t_min:.9g}"), (f"{thermal}TMAX", f"{t_max:.9g}")]
    rows += [
        (f"{thermal}GYR{power + 1}_{axis.upper()}", f"{values[power, column]:.9g}")
        for power in range(len(values))
        for column, axis in enumerate(AXES)
    ]
    rows += [(f"{offset}{axis.upper()}", f"{offsets[column]:.9g}") for column, axis in enumerate(AXES)]
    rows.append((caltemp, f"{at_c:.9g}"))
    limits = (
        f"{thermal}TMIN and {thermal}TMAX limit the accelerometers of this IMU too: their coefficients ({thermal}ACC*) "
        "are not in this file; set them to 0 or calibrate them in this range."
    )
    learnt = (
        f"The vehicle learns {offset}X, _Y and _Z anew at each start unless INS_GYR_CAL is 0; it sets {caltemp} with "
        "them."
    )
    head = head_lines(
        calibration, "the bias over temperature, as a cubic about 35 deg C in 1e-6 rad/s, and its constant in rad/s",
        float(differences_seen.at_rest.max()), losses,
        ["Axes are the sensor's own after the rotation by its driver, before that of the board.", limits, learnt],
    )  # fmt: skip
    body = "".join(f"{name},{value}\n" for name, value in rows)
    return Written((commented(head) + body).encode("ascii"), losses, float(differences_seen.at_rest.max()))


FORMAT = Format(
    "ArduPilot parameters",
    "text/plain; charset=us-ascii",
    "param",
    write,
    {"imu": "number of the IMU, 1 to 5; default 1", **COMMON_OPTIONS},
)
