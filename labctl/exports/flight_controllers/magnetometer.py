"""Hard and soft iron as parameters of PX4 and ArduPilot.

Both apply one symmetric matrix to the reading without its offset. PX4: scale (data - offset), gauss, in the axes of
the sensor (Magnetometer.hpp, Correct). ArduPilot: matrix (data + offset) times COMPASS_SCALE, milligauss, after the
rotation of sensor and board (AP_Compass_Backend, correct_field); COMPASS_SCALE is written as 1: the matrix holds it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from labctl.errors import BadInput
from labctl.exports.comments import commented, plain
from labctl.exports.options import check_instance
from labctl.exports.sensors.parameters import FieldParameters
from labctl.fitting.magnetometer.calibrate import AXES

#: One gauss and one milligauss, in uT.
GAUSS_UT, MILLIGAUSS_UT = 100.0, 0.1
#: ArduPilot refuses larger offsets (COMPASS_OFFS_MAX as it ships), milligauss.
LARGEST_OFFSET_MGAUSS = 1800.0
#: MAVLink types of parameters.
FLOAT, INTEGER = 9, 6
#: The elements off the diagonal in the order of both: xy, xz, yz.
OFF_DIAGONAL = ((0, 1), (0, 2), (1, 2))


def _lost(result: FieldParameters, place: str) -> list[str]:
    """Return the line that says what a format without a rotation loses."""
    if result.turned_rad is None:
        return []
    angle = float(np.degrees(np.linalg.norm(result.turned_rad)))
    return [f"LOST alignment: turned by {angle:.2g} deg from the accelerometer; {place}"]


def px4(result: FieldParameters, head: Sequence[str], instance: int, device_id: int | None) -> str:
    """Return a file of parameters that QGroundControl loads; raises BadInput for an instance that PX4 has not."""
    check_instance("px4", instance, 0, 3)
    name = f"CAL_MAG{instance}_"
    rows = [] if device_id is None else [(f"{name}ID", str(device_id), INTEGER)]
    offset, matrix = result.hard_iron_ut / GAUSS_UT, result.soft_iron
    rows += [(f"{name}{axis.upper()}OFF", f"{value:.9g}", FLOAT) for axis, value in zip(AXES, offset, strict=True)]
    rows += [(f"{name}{axis.upper()}SCALE", f"{matrix[i, i]:.9g}", FLOAT) for i, axis in enumerate(AXES)]
    rows += [(f"{name}{axis.upper()}ODIAG", f"{matrix[place]:.9g}", FLOAT)
             for axis, place in zip(AXES, OFF_DIAGONAL, strict=True)]  # fmt: skip
    notes = [
        "Axes are the sensor's own, as in its raw output, before the rotations of sensor and board.",
        "Vehicle, component, parameter, value, type (6: integer, 9: float):",
    ]
    notes = _lost(result, f"{name}ROT and the angles beside it are not in this file.") + notes
    if device_id is None:
        notes.insert(0, f"{name}ID is not in this file and must be the sensor's device id (--device-id).")
    body = "".join(f"1\t1\t{row}\t{value}\t{kind}\n" for row, value, kind in rows)
    return commented([*map(plain, head), *notes]) + body


def ardupilot(result: FieldParameters, head: Sequence[str], instance: int, device_id: int | None) -> str:
    """Return a file of parameters that Mission Planner loads.

    Raises BadInput for an instance that ArduPilot has not, and for an offset that it refuses.
    """
    check_instance("ardupilot", instance, 1, 3)
    number = "" if instance == 1 else str(instance)
    offset = -result.hard_iron_ut / MILLIGAUSS_UT
    worst = max(range(3), key=lambda i: abs(offset[i]))
    if abs(offset[worst]) > LARGEST_OFFSET_MGAUSS:
        raise BadInput(
            f"format ardupilot: the offset of {AXES[worst]} is {offset[worst]:.0f} mgauss, but ArduPilot takes at most "
            f"{LARGEST_OFFSET_MGAUSS:.0f}; move the magnetometer away from iron, or check --unit"
        )
    matrix = result.soft_iron
    rows = [] if device_id is None else [(f"COMPASS_DEV_ID{number}", str(device_id))]
    rows += [(f"COMPASS_OFS{number}_{axis.upper()}", f"{value:.7g}") for axis, value in zip(AXES, offset, strict=True)]
    rows += [(f"COMPASS_DIA{number}_{axis.upper()}", f"{matrix[i, i]:.7g}") for i, axis in enumerate(AXES)]
    rows += [(f"COMPASS_ODI{number}_{axis.upper()}", f"{matrix[place]:.7g}")
             for axis, place in zip(AXES, OFF_DIAGONAL, strict=True)]  # fmt: skip
    rows.append((f"COMPASS_SCALE{number}", "1"))
    notes = [
        "ArduPilot corrects after the rotation of sensor and board: the readings must be in these axes, as in its log."
    ]
    notes += _lost(result, "COMPASS_ORIENT takes steps of 45 deg only.")
    return commented([*map(plain, head), *notes]) + "".join(f"{row},{value}\n" for row, value in rows)
