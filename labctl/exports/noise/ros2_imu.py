"""The covariance of `angular_velocity` in sensor_msgs/Imu, as a parameter file of ROS 2.

The message's `angular_velocity_covariance` is row major about x, y, z in (rad/s)^2; all zeros mean that it is unknown.
Written: variance of the white noise at the rate of the messages, plus the square of the calibration's error.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.comments import commented, head_lines
from labctl.exports.flight_controllers.bias_cubic import AXES
from labctl.exports.format import Format, Written
from labctl.exports.noise.correction_size import correction_losses
from labctl.exports.noise.figures import OPTIONS, WALK, noise_of

NAME = "ros2-imu"


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the parameters; raises BadInput for a gyro of fewer axes, or where its noise is not known."""
    missing = [axis for axis in AXES if axis not in calibration.axes]
    if missing:
        raise BadInput(
            f"format {NAME} needs covariances of x, y and z, but {calibration.serial} is calibrated only along "
            f"{', '.join(calibration.axes)}; calibrate {', '.join(missing)} too"
        )
    noise = noise_of(calibration, options, NAME)
    order = [calibration.axes.index(axis) for axis in AXES]
    white = noise.white[order] ** 2 * noise.rate_hz
    error = calibration.document["error"]
    residual = error["heldout_rms_dps"] if error["heldout_rms_dps"] is not None else error["rms_dps"]
    of_calibration = float(np.deg2rad(residual or 0.0)) ** 2
    covariance = np.diag(white + of_calibration)
    losses = correction_losses(
        calibration, "the covariance is that of corrected readings, so correct the readings first"
    )
    head = head_lines(calibration, "the covariance of corrected rates at one rate of messages", None, losses, [
        "Correct the readings by the calibration (format python, c or json) before they are published.",
        f"White noise at {noise.rate_hz:.6g} Hz, (rad/s)^2 of x, y, z: " + ", ".join(f"{v:.6e}" for v in white),
        f"Error of the calibration, the same on each axis, (rad/s)^2: {of_calibration:.6e}; it does not average out.",
    ])  # fmt: skip
    values = ", ".join(f"{value:.9e}" for value in covariance.ravel())
    body = f"/**:\n  ros__parameters:\n    angular_velocity_covariance: [{values}]\n"
    return Written((commented(head) + body).encode("ascii"), losses)


FORMAT = Format(
    "ROS 2 Imu covariance (YAML)",
    "application/yaml",
    "yaml",
    write,
    {name: text for name, text in OPTIONS.items() if name != WALK},
    needs_noise=True,
)
