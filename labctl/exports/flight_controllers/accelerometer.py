"""Bias and scale factors of an accelerometer as parameters of PX4 and ArduPilot.

Both compute scale (data - offset), m/s2, axis by axis: PX4 in the axes of the sensor (Accelerometer.hpp, Correct),
ArduPilot after the rotation of the sensor (AP_InertialSensor_Backend, _rotate_and_correct_accel). Neither has a place
for misalignments; how much of gravity's size that loses is in the head of the file.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.errors import BadInput
from labctl.exports.comments import commented, plain
from labctl.exports.options import check_instance
from labctl.exports.sensors.parameters import ForceParameters
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.gravity import STANDARD_GRAVITY
from labctl.fitting.poses.readings import AXES

#: MAVLink types of parameters.
FLOAT, INTEGER = 9, 6
#: Priority of a sensor as PX4 gives it by itself: medium.
PRIORITY = 50
#: Ranges that ArduPilot documents for its parameters.
LARGEST_OFFSET_M_S2, SCALES = 3.5, (0.8, 1.2)


def misalignment_loss_g(found: ForceParameters) -> float:
    """Return the largest error, over all directions, of gravity's size that is left without the misalignments, g."""
    inverse = np.linalg.inv(np.eye(3) + found.errors)
    left = inverse @ np.diag(1 + np.diag(found.errors)) - np.eye(3)
    return found.gravity_g * float(np.abs(np.linalg.eigvalsh((left + left.T) / 2)).max())


def px4(found: ForceParameters, head: Sequence[str], instance: int, device_id: int | None) -> str:
    """Return a file of parameters that QGroundControl loads; raises BadInput for an instance that PX4 has not."""
    check_instance("px4", instance, 0, 3)
    name = f"CAL_ACC{instance}_"
    offset, scale = _offset_and_scale(found)
    rows = [] if device_id is None else [(f"{name}ID", str(device_id), INTEGER)]
    rows.append((f"{name}PRIO", str(PRIORITY), INTEGER))
    rows += [(f"{name}{axis.upper()}OFF", f"{value:.9g}", FLOAT) for axis, value in zip(AXES, offset, strict=True)]
    rows += [(f"{name}{axis.upper()}SCALE", f"{value:.9g}", FLOAT) for axis, value in zip(AXES, scale, strict=True)]
    notes = [
        _lost(found, "PX4"),
        "Axes are the sensor's own, as in its raw output, before the rotations of sensor and board.",
        "Vehicle, component, parameter, value, type (6: integer, 9: float):",
    ]
    if device_id is None:
        notes.insert(0, f"{name}ID is not in this file and must be the sensor's device id (--device-id).")
    body = "".join(f"1\t1\t{row}\t{value}\t{kind}\n" for row, value, kind in rows)
    return commented([*map(plain, head), *notes]) + body


def ardupilot(found: ForceParameters, head: Sequence[str], instance: int, device_id: int | None) -> str:
    """Return a file of parameters that Mission Planner loads.

    Raises BadInput for an instance that ArduPilot has not, and for values outside the ranges that it documents.
    """
    check_instance("ardupilot", instance, 1, 3)
    number = "" if instance == 1 else str(instance)
    offset, scale = _offset_and_scale(found)
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
    notes = [
        _lost(found, "ArduPilot"),
        "Axes are the sensor's own after the rotation by its driver, before that of the board.",
    ]
    return commented([*map(plain, head), *notes]) + "".join(f"{row},{value}\n" for row, value in rows)


def _offset_and_scale(found: ForceParameters) -> tuple[Array, Array]:
    return found.bias_g * STANDARD_GRAVITY, 1 / (1 + np.diag(found.errors))


def _lost(found: ForceParameters, consumer: str) -> str:
    return f"LOST misalignments ({consumer} has no place for them): up to {misalignment_loss_g(found):.2g} g of 1 g."
