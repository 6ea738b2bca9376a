"""The alignment as a static transform of ROS: the command of tf2_ros, and a fixed joint of URDF.

In both the rotation R from parent to child has the child's axes, along those of the parent, as columns: what is along
the child's axes is turned into the parent's by R. tf2 takes the quaternion x y z w of R (geometry_msgs/Quaternion),
URDF the angles about the fixed axes x, then y, then z of the parent: R = Rz(yaw) Ry(pitch) Rx(roll) (ROS REP 103).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.exports.comments import commented, plain
from labctl.exports.sensors.parameters import AccelerometerParameters, Parameters
from labctl.fitting.numeric.arrays import Array

PARENT = "accelerometer"
#: Below this cosine of the pitch, the pitch is 90 deg: roll and yaw turn about the same axis then.
MIN_COS_PITCH = 1e-9
OFFSET = "The distance of the sensors from each other is not measured: x, y and z are 0."
RATES = (
    "For rates and forces that labctl's matrices have not corrected: corrected rates are in the accelerometer's axes "
    "already."
)
FIELD = "For a field and forces that labctl's calibrations have corrected."


def quaternion_of(turned_rad: Array) -> Array:
    """Return the unit quaternion x, y, z, w (4,) of a rotation vector (3,), rad; w is 0 or more up to half a turn."""
    half = float(np.linalg.norm(turned_rad)) / 2
    return np.append(turned_rad * (np.sinc(half / np.pi) / 2), np.cos(half))


def roll_pitch_yaw_of(turned_rad: Array) -> Array:
    """Return the angles (3,), rad, about the fixed axes x, y, z, one after the other, of a rotation vector (3,), rad.

    Where the pitch is 90 deg the yaw is 0.
    """
    r = _matrix_of(quaternion_of(turned_rad))
    cos_pitch = float(np.hypot(r[0, 0], r[1, 0]))
    pitch = np.arctan2(-r[2, 0], cos_pitch)
    if cos_pitch < MIN_COS_PITCH:
        return np.array([np.arctan2(-r[1, 2], r[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(r[2, 1], r[2, 2]), pitch, np.arctan2(r[1, 0], r[0, 0])])


def _matrix_of(quaternion: Array) -> NDArray[np.float64]:
    """Return the rotation (3, 3) of a unit quaternion x, y, z, w (4,)."""
    x, y, z, w = quaternion
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def command_of(turned_rad: Array, child: str) -> str:
    """Return the command that publishes the transform from the accelerometer to `child` (ROS 2)."""
    named = zip("xyzw", quaternion_of(turned_rad) + 0.0, strict=True)
    turn = " ".join(f"--q{name} {value:.9f}" for name, value in named)
    return f"ros2 run tf2_ros static_transform_publisher {turn} --frame-id {PARENT} --child-frame-id {child}"


def tf2(parameters: Parameters, head: Sequence[str]) -> str:
    """Return a shell script of one command. Raises BadInput where the alignment is unknown."""
    rotation_rad, child, use = _turn("tf2", parameters)
    notes = [
        f"Rotation from {PARENT} (parent) to {child} (child); it turns a vector of the child into the parent's axes.",
        use,
        OFFSET,
    ]
    return commented([*map(plain, head), *notes]) + command_of(rotation_rad, child) + "\n"


def urdf(parameters: Parameters, head: Sequence[str]) -> str:
    """Return two links and the fixed joint between them. Raises BadInput where the alignment is unknown."""
    rotation_rad, child, use = _turn("urdf", parameters)
    notes = [
        *map(plain, head),
        "rpy: angles in rad about the fixed axes x, then y, then z of the parent (roll, pitch, yaw).", use, OFFSET,
    ]  # fmt: skip
    comment = "\n     ".join(notes).replace("--", "- -")  # two hyphens would end the comment
    angles = " ".join(f"{value:.12g}" for value in roll_pitch_yaw_of(rotation_rad) + 0.0)
    return (
        f'<?xml version="1.0"?>\n<!-- {comment} -->\n<robot name="{PARENT}_and_{child}">\n'
        f'  <link name="{PARENT}"/>\n  <link name="{child}"/>\n'
        f'  <joint name="{PARENT}_to_{child}" type="fixed">\n'
        f'    <parent link="{PARENT}"/>\n    <child link="{child}"/>\n'
        f'    <origin xyz="0 0 0" rpy="{angles}"/>\n'
        "  </joint>\n</robot>\n"
    )


def _turn(name: str, parameters: Parameters) -> tuple[Array, str, str]:
    """Return the rotation vector, the frame that is turned, and what the transform is for."""
    is_force = isinstance(parameters, AccelerometerParameters)
    child, use = ("gyro", RATES) if is_force else ("magnetometer", FIELD)
    rotation_rad = (
        parameters.gyro_turned_rad if isinstance(parameters, AccelerometerParameters) else parameters.turned_rad
    )
    if rotation_rad is None:
        raise BadInput(
            f"--export {name}: the alignment of the {child} is unknown; calibrate by the recording of a unit that was "
            "turned from pose to pose"
        )
    return rotation_rad, child, use
