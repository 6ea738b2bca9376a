"""The IMU file of Kalibr and of estimators on ROS that read the same keys: noise densities and nothing else.

Kalibr takes one number for all axes and turns a density into the standard deviation of a reading by multiplying with
sqrt(update_rate); every value must be above 0 (ImuConfig of its ConfigReader).
"""

from __future__ import annotations

from collections.abc import Mapping

from labctl.calibration import Calibration
from labctl.errors import BadInput
from labctl.exports.comments import commented, head_lines, plain
from labctl.exports.format import Format, Loss, Written
from labctl.exports.noise.correction_size import correction_losses
from labctl.exports.noise.figures import OPTIONS, WALK, noise_of

NAME = "kalibr"
#: Values of the accelerometer that Kalibr asks for and labctl does not know: those of its own example, an ADIS16448.
ACCELEROMETER = {"accelerometer_noise_density": 0.006, "accelerometer_random_walk": 0.0002}


def write(calibration: Calibration, options: Mapping[str, str]) -> Written:
    """Return the file; raises BadInput where noise, random walk or the rate of the readings is not known."""
    noise = noise_of(calibration, options, NAME)
    if noise.walk is None:
        raise BadInput(
            f"format {NAME}: the rate random walk of {calibration.serial} is not known, but Kalibr needs a "
            f"value above 0; record the unit at rest for longer, or give option {WALK}"
        )
    losses = (
        *correction_losses(calibration, "the file of Kalibr contains noise figures only"),
        Loss("lower noise of other axes (one number for all; the largest is written)",
             float(noise.white.max() / noise.white.min()), "times"),
    )  # fmt: skip
    head = head_lines(calibration, "white noise and rate random walk, the largest of the axes", None, losses, [
        "Correct the readings by the calibration (format python, c or json) before these numbers are used.",
        "accelerometer_* are placeholders: a gyro's calibration knows nothing of the accelerometer; replace them.",
    ])  # fmt: skip
    lines = [f"{name}: {value:g}  # placeholder" for name, value in ACCELEROMETER.items()]
    lines += [
        f"gyroscope_noise_density: {float(noise.white.max()):.9e}  # rad/s/sqrt(Hz)",
        f"gyroscope_random_walk: {float(noise.walk.max()):.9e}  # rad/s^2/sqrt(Hz)",
        f"update_rate: {noise.rate_hz:.9g}  # Hz",
        f"rostopic: {plain(options.get('rostopic', '/imu0'))}",
    ]
    return Written((commented(head) + "\n".join(lines) + "\n").encode("ascii"), losses)


FORMAT = Format(
    "Kalibr noise (YAML)",
    "application/yaml",
    "yaml",
    write,
    {**OPTIONS, "rostopic": "topic of the readings; default /imu0"},
    needs_noise=True,
)
