"""Every format of a sensor's calibration, by sensor and name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from labctl.errors import BadInput
from labctl.exports.flight_controllers import accelerometer, magnetometer
from labctl.exports.sensors import program, robots, static_transform
from labctl.exports.sensors.parameters import Parameters


@dataclass(frozen=True)
class SensorFormat:
    """A format: its title, the suffix and media type of its files, and its writer.

    `first` is the number of the first sensor at an autopilot; None: the format has no numbers and no device ids.
    `of_alignment`: it carries the alignment and nothing else.
    """

    title: str
    suffix: str
    media_type: str
    write: Callable[..., str]
    first: int | None = None
    of_alignment: bool = False


_TEXT = "text/plain; charset=us-ascii"
_PROGRAMS = {
    "json": SensorFormat("JSON", "json", "application/json", program.json_text),
    "python": SensorFormat("Python module", "py", _TEXT, program.python_text),
    "c": SensorFormat("C99 header", "h", _TEXT, program.c_text),
}
_TRANSFORMS = {
    "tf2": SensorFormat("ROS 2 static transform (command)", "sh", _TEXT, static_transform.tf2, of_alignment=True),
    "urdf": SensorFormat("URDF fixed joint", "urdf", "application/xml", static_transform.urdf, of_alignment=True),
}
SENSOR_FORMATS: Mapping[str, Mapping[str, SensorFormat]] = {
    "accelerometer": {
        "px4": SensorFormat("PX4 parameters", "params", _TEXT, accelerometer.px4, first=0),
        "ardupilot": SensorFormat("ArduPilot parameters", "param", _TEXT, accelerometer.ardupilot, first=1),
        "kalibr": SensorFormat("Kalibr scale-misalignment (YAML)", "yaml", _TEXT, robots.kalibr),
        "ros": SensorFormat("ROS imu_calib (YAML)", "yaml", _TEXT, robots.ros),
        **_PROGRAMS,
        **_TRANSFORMS,
    },
    "magnetometer": {
        "px4": SensorFormat("PX4 parameters", "params", _TEXT, magnetometer.px4, first=0),
        "ardupilot": SensorFormat("ArduPilot parameters", "param", _TEXT, magnetometer.ardupilot, first=1),
        **_PROGRAMS,
        **_TRANSFORMS,
    },
}


def format_of(parameters: Parameters, name: str) -> SensorFormat:
    """Return a format of a sensor. Raises BadInput for one that it has not."""
    formats = SENSOR_FORMATS[parameters.sensor]
    if name not in formats:
        raise BadInput(
            f"--export {name}: this {parameters.sensor} is exported to {', '.join(formats)}; name one of them"
        )
    return formats[name]


def written(parameters: Parameters, head: Sequence[str], name: str, instance: int | None, device_id: int | None) -> str:
    """Return a sensor's calibration in a format. Raises BadInput for what the format cannot express."""
    sensor_format = format_of(parameters, name)
    if sensor_format.first is not None:
        return sensor_format.write(parameters, head, sensor_format.first if instance is None else instance, device_id)
    stated_options: dict[str, Any] = {"--instance": instance, "--device-id": device_id}
    if wrong := [option for option, value in stated_options.items() if value is not None]:
        raise BadInput(f"--export {name} takes no {wrong[0]}: it is for the parameters of an autopilot; leave it out")
    return sensor_format.write(parameters, head)
