"""Bias and scale factors of an accelerometer as parameters of PX4 and ArduPilot.

Both compute scale (data - offset), m/s2, axis by axis: PX4 in the axes of the sensor (Accelerometer.hpp, Correct),
ArduPilot after the rotation of the sensor (AP_InertialSensor_Backend, _rotate_and_correct_accel). Neither has a place
for misalignments; how much of gravity's size that loses is in the head of the file.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.exports.comments import commented, plain
from labctl.exports.flight_controllers.ardupilot import LIMITS_C, REFERENCE_C, SCALE, parameter_names
from labctl.exports.options import check_instance
from labctl.exports.sensors.parameters import ForceParameters, TemperatureParameters
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY
from labctl.fitting.poses.readings import AXES

#: MAVLink types of parameters.
FLOAT, INTEGER = 9, 6
#: Priority of a sensor as PX4 gives it by itself: medium.
PRIORITY = 50
#: Largest power of temperature that both have.
ORDER = 3
PX4_NOTES = (
    "TC_A*: what the bias differs by from that at TREF, which is in CAL_ACC*OFF.",
    "PX4 applies a new offset when the temperature has moved by 1 K. Calibrate the offsets again only at TREF.",
)
ARDUPILOT_NOTE = (
    "INS_TCAL* holds for the gyros too: their coefficients (GYR*) are not in this file; TMIN and TMAX limit both."
)
#: Ranges that ArduPilot documents for its parameters.
LARGEST_OFFSET_M_S2, SCALES = 3.5, (0.8, 1.2)


def misalignment_loss_g(parameters: ForceParameters) -> float:
    """Return the largest error, over all directions, of gravity's size that is left without the misalignments, g."""
    inverse = np.linalg.inv(np.eye(3) + parameters.errors)
    residual = inverse @ np.diag(1 + np.diag(parameters.errors)) - np.eye(3)
    return parameters.gravity_g * float(np.abs(np.linalg.eigvalsh((residual + residual.T) / 2)).max())


def px4(parameters: ForceParameters, head: Sequence[str], instance: int, device_id: int | None) -> str:
    """Return a file of parameters that QGroundControl loads; raises BadInput for an instance that PX4 has not."""
    check_instance("px4", instance, 0, 3)
    name = f"CAL_ACC{instance}_"
    offset, scale = _offset_and_scale(parameters)
    rows = [] if device_id is None else [(f"{name}ID", str(device_id), INTEGER)]
    rows.append((f"{name}PRIO", str(PRIORITY), INTEGER))
    rows += [(f"{name}{axis.upper()}OFF", f"{value:.9g}", FLOAT) for axis, value in zip(AXES, offset, strict=True)]
    rows += [(f"{name}{axis.upper()}SCALE", f"{value:.9g}", FLOAT) for axis, value in zip(AXES, scale, strict=True)]
    response = parameters.temperature
    if response is not None:
        rows += _px4_temperature(response, instance, device_id)
    notes = [
        *([] if response is None else [response.lost(parameters.gravity_g, bias=False), *PX4_NOTES]),
        _lost(parameters, "PX4"),
        "Axes are the sensor's own, as in its raw output, before the rotations of sensor and board.",
        "Vehicle, component, parameter, value, type (6: integer, 9: float):",
    ]
    if device_id is None:
        notes.insert(0, f"{name}ID is not in this file and must be the sensor's device id (--device-id).")
    body = "".join(f"1\t1\t{row}\t{value}\t{kind}\n" for row, value, kind in rows)
    return commented([*map(plain, head), *notes]) + body


def ardupilot(parameters: ForceParameters, head: Sequence[str], instance: int, device_id: int | None) -> str:
    """Return a file of parameters that Mission Planner loads.

    Raises BadInput for an instance that ArduPilot has not, and for values outside the ranges that it documents.
    """
    check_instance("ardupilot", instance, 1, 3)
    number = "" if instance == 1 else str(instance)
    offset, scale = _offset_and_scale(parameters)
    if parameters.temperature is not None:  # the constant is that at ACC_CALTEMP, by the parameters as they are written
        offset = (
            offset
            + parameters.temperature.bias_change_g(np.array([_cal_c(parameters.temperature)]))[0] * STANDARD_GRAVITY
        )
    for axis, value, factor in zip(AXES, offset, scale, strict=True):
        if abs(value) > LARGEST_OFFSET_M_S2 or not SCALES[0] <= factor <= SCALES[1]:
            raise BadInput(
                f"format ardupilot: {axis} has the offset {value:.3g} m/s2 and the scale {factor:.3g}; ArduPilot takes "
                f"offsets up to {LARGEST_OFFSET_M_S2:g} m/s2 and scales from {SCALES[0]:g} to {SCALES[1]:g}; check the "
                "unit of the readings (--unit)"
            )
    rows = [] if device_id is None else [(f"INS_ACC{number}_ID", str(device_id))]
    for kind, values in (("OFFS", offset), ("SCAL", scale)):
        rows += [(f"INS_ACC{number}{kind}_{axis.upper()}", f"{value:.9g}")
                 for axis, value in zip(AXES, values, strict=True)]  # fmt: skip
    response = parameters.temperature
    if response is not None:
        rows += _ardupilot_temperature(response, instance)
    notes = [
        *([] if response is None else [response.lost(parameters.gravity_g, bias=False), ARDUPILOT_NOTE]),
        _lost(parameters, "ArduPilot"),
        "Axes are the sensor's own after the rotation by its driver, before that of the board.",
    ]
    return commented([*map(plain, head), *notes]) + "".join(f"{row},{value}\n" for row, value in rows)


def _px4_temperature(
    temperature: TemperatureParameters, instance: int, device_id: int | None
) -> list[tuple[str, str, int]]:
    """Return TC_A*: what the bias differs by from that at TREF, which is CAL_ACCn_*OFF, m/s2."""
    name = f"TC_A{instance}_"
    low, high = temperature.range_c
    rows = [("TC_A_ENABLE", "1", INTEGER)]
    rows += [] if device_id is None else [(f"{name}ID", str(device_id), INTEGER)]
    rows += [(f"{name}{key}", f"{value:.9g}", FLOAT) for key, value in
             (("TREF", temperature.reference_c), ("TMIN", low), ("TMAX", high))]  # fmt: skip
    terms = np.zeros((ORDER + 1, len(AXES)))
    terms[1 : len(temperature.bias_g) + 1] = temperature.bias_g * STANDARD_GRAVITY
    rows += [(f"{name}X{power}_{axis}", f"{terms[power, axis]:.9g}", FLOAT)
             for power in range(ORDER, -1, -1) for axis in range(len(AXES))]  # fmt: skip
    return rows


def _ardupilot_temperature(temperature: TemperatureParameters, instance: int) -> list[tuple[str, str]]:
    """Return INS_TCALn_*: the same polynomial about 35 deg C, 1e-6 m/s2, without its constant."""
    low, high = temperature.range_c
    if low < LIMITS_C[0] or high > LIMITS_C[1]:
        raise BadInput(
            f"format ardupilot: calibrated from {low:g} to {high:g} deg C; TMIN and TMAX of ArduPilot go only from "
            f"{LIMITS_C[0]:g} to {LIMITS_C[1]:g} deg C; use --export json or px4"
        )
    thermal = parameter_names(instance)[0]
    terms = _about(temperature, REFERENCE_C) * STANDARD_GRAVITY * SCALE
    rows = [(f"{thermal}ENABLE", "1"), (f"{thermal}TMIN", f"{low:.9g}"), (f"{thermal}TMAX", f"{high:.9g}")]
    rows += [(f"{thermal}ACC{power}_{axis.upper()}", f"{terms[power, i]:.9g}")
             for power in range(1, ORDER + 1) for i, axis in enumerate(AXES)]  # fmt: skip
    return [*rows, (f"INS_ACC{instance}_CALTEMP", f"{_cal_c(temperature):.9g}")]


def _cal_c(temperature: TemperatureParameters) -> float:
    return float(np.clip(REFERENCE_C, *temperature.range_c))


def _about(temperature: TemperatureParameters, about_c: float) -> NDArray[np.float64]:
    """Return the bias by powers of the temperature from `about_c`, (4, 3) g/K^k."""
    away = about_c - temperature.reference_c
    terms = np.zeros((ORDER + 1, len(AXES)))
    for power, row in enumerate(temperature.bias_g, start=1):
        for k in range(power + 1):
            terms[k] += comb(power, k) * away ** (power - k) * row
    return terms


def _offset_and_scale(parameters: ForceParameters) -> tuple[Array, Array]:
    return parameters.bias_g * STANDARD_GRAVITY, 1 / (1 + np.diag(parameters.errors))


def _lost(parameters: ForceParameters, consumer: str) -> str:
    return (
        f"LOST misalignments ({consumer} has no place for them): up to {misalignment_loss_g(parameters):.2g} g of 1 g."
    )
