"""An accelerometer's calibration for robots: the intrinsic matrix of Kalibr, and the file of imu_calib on ROS."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.exports.comments import commented, plain
from labctl.exports.sensors.parameters import AccelerometerParameters
from labctl.exports.sensors.static_transform import command_of


def lower_triangle(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower triangular M with M force' = (1 + errors) force, where force' is force in turned axes.

    Kalibr's x axis is the accelerometer's own, labctl's z axis is: the turn between the two changes no size.
    """
    _, upper = np.linalg.qr((np.eye(3) + errors).T)
    lower = np.tril((upper * np.sign(np.diag(upper))[:, None]).T)
    return np.asarray(lower + 0.0, dtype=np.float64)  # no minus before a zero


def kalibr(parameters: AccelerometerParameters, head: Sequence[str]) -> str:
    """Return Kalibr's keys of the model scale-misalignment: reading = M force + bias (IccScaledMisalignedImu)."""
    offset = ", ".join(f"{value:.6g}" for value in parameters.offset)
    notes = [
        "The keys of the file that Kalibr writes with --imu-models scale-misalignment: reading = M force + bias.",
        "M is lower triangular: the x axis is the accelerometer's own, the y axis lies in the plane of its x and y.",
        f"LOST bias: Kalibr estimates it over time; here x, y, z = {offset} m/s2.",
        "accelerometer_random_walk is not in this file: rests of seconds do not tell it.",
    ]
    if parameters.gyro_turned_rad is not None:
        notes.append("LOST gyroscopes: C_gyro_i is by lower triangular axes, and needs the M of the gyro beside it.")
    notes += _lost_temperature(parameters)
    body = ["model: scale-misalignment", "accelerometers:", "  M:"]
    body += ["  - [" + ", ".join(f"{value:.12g}" for value in row) + "]" for row in lower_triangle(parameters.errors)]
    body.append(f"accelerometer_noise_density: {parameters.noise_density_m_s2:.9e}  # m/s^2/sqrt(Hz), the largest axis")
    return commented([*map(plain, head), *notes]) + "\n".join(body) + "\n"


def ros(parameters: AccelerometerParameters, head: Sequence[str]) -> str:
    """Return the file that the node apply_calib of imu_calib reads: corrected = SM reading - bias, in m/s2."""
    matrix = parameters.matrix
    notes = ["For the node apply_calib of the ROS package imu_calib: corrected = SM reading - bias, m/s2."]
    notes += _lost_temperature(parameters) + _transform(parameters)
    body = [
        "SM: [" + ", ".join(f"{value:.12g}" for value in matrix.ravel()) + "]",
        "bias: [" + ", ".join(f"{value:.12g}" for value in matrix @ parameters.offset) + "]",
    ]
    return commented([*map(plain, head), *notes]) + "\n".join(body) + "\n"


def _transform(parameters: AccelerometerParameters) -> list[str]:
    """Return the static transform from the accelerometer's frame to the gyro's, as a command of tf2_ros."""
    if parameters.gyro_turned_rad is None:
        return []
    return [
        "LOST gyro triad; for rates that labctl's matrix has not corrected, which has this turn in it:",
        command_of(parameters.gyro_turned_rad, "gyro"),
    ]


def _lost_temperature(parameters: AccelerometerParameters) -> list[str]:
    return [] if parameters.temperature is None else [parameters.temperature.lost(parameters.gravity_g, bias=True)]
