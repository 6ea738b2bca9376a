"""Which value of a line is which column of a recording, and in which unit: by the names of the values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from labctl.errors import BadInput
from labctl.recording.checks import POSSIBLE
from labctl.recording.column_map.conversion import LARGEST_RATE_DPS
from labctl.recording.column_map.names import name_says
from labctl.recording.column_map.units import QUANTITIES, find_unit, names_of, unit_of_target

#: The columns that a stream may have beside time.
_GYROS = tuple(f"gyro_{axis}" for axis in "xyz")
_FORCES = tuple(f"accel_{axis}_g" for axis in "xyz")
_OTHERS = ("temperature_c", "supply_v", "valid", *(f"field_{axis}_ut" for axis in "xyz"))
#: Units of the vectors of a sensor_msgs/Imu, which are SI (ROS REP 103).
_ROS_UNITS = {"angular_velocity": "rad/s", "linear_acceleration": "m/s2"}
#: What no sensor of a unit on a desk gives, in the units of a recording; gyros and thermometers have own limits.
LARGEST_VALUE = 1e6


@dataclass(frozen=True)
class LineField:
    """One value of a line: column = factor x value + zero; outside of `limits` the line is damaged."""

    name: str
    target: str
    factor: float
    zero: float
    limits: tuple[float, float]


@dataclass(frozen=True)
class LineLayout:
    """The values of a line that are used, and the values that make its time: their sum, each in its unit."""

    names: tuple[str, ...]  #: of all values of a CSV line, in order; of a JSON object those of the first
    fields: tuple[LineField, ...]
    time: Mapping[str, float]  #: name -> seconds of one; empty: the lines have no time


#: The values of `ros2 topic echo --csv` of a sensor_msgs/msg/Imu.
ROS_IMU: tuple[str, ...] = (
    "header.stamp.sec", "header.stamp.nanosec", "header.frame_id",
    *(f"orientation.{axis}" for axis in "xyzw"), *(f"orientation_covariance.{k}" for k in range(9)),
    *(f"angular_velocity.{axis}" for axis in "xyz"), *(f"angular_velocity_covariance.{k}" for k in range(9)),
    *(f"linear_acceleration.{axis}" for axis in "xyz"), *(f"linear_acceleration_covariance.{k}" for k in range(9)),
)  # fmt: skip


def layout_of(names: Sequence[str]) -> LineLayout:
    """Return the layout of lines whose values have names.

    Raises BadInput where a rate or a specific force is missing, named twice, or in an unknown unit.
    """
    fields: dict[str, LineField] = {}
    for name in names:
        found = _field(name)
        if found is None:
            continue
        if found.target in fields:
            raise BadInput(
                f"two values of a line are {found.target}: {fields[found.target].name!r} and {name!r}; name the "
                "columns with --columns, and the one to leave out '-'"
            )
        fields[found.target] = found
    if absent := [target for target in (*_GYROS, *_FORCES) if target not in fields]:
        raise BadInput(
            f"the lines have no {', '.join(absent)} (their values: {', '.join(names)[:200] or 'none'}); name the "
            "columns with --columns, such as t_s,gyro_x,gyro_y,gyro_z,accel_x_g,accel_y_g,accel_z_g"
        )
    return LineLayout(tuple(names), tuple(fields.values()), _time(names))


def _field(name: str) -> LineField | None:
    says = name_says(name)
    if says.target not in (*_GYROS, *_FORCES, *_OTHERS) or name.startswith("orientation"):
        return None
    quantity = unit_of_target(says.target)
    limits = POSSIBLE.get(says.target, (-LARGEST_VALUE, LARGEST_VALUE))
    if says.target.startswith("gyro_"):
        limits = (-LARGEST_RATE_DPS, LARGEST_RATE_DPS)
    if quantity not in QUANTITIES or name == says.target:  # a column's own name says its unit
        return LineField(name, says.target, 1.0, 0.0, limits)
    word = says.unit or _ROS_UNITS.get(name.split(".")[-2] if "." in name else "", "")
    unit = find_unit(quantity, word) if word else None
    if unit is None:
        raise BadInput(
            f"the unit of {name!r} in the lines is not known; name the column with its unit, such as "
            f"'{says.target} ({quantity})', with --columns or in the header (units: {names_of(quantity)})"
        )
    return LineField(name, says.target, unit.factor, unit.zero, limits)


def _time(names: Sequence[str]) -> dict[str, float]:
    """Return what of a line is its time; a ROS stamp is two values."""
    stamp: dict[str, float] = {}
    for name in names:
        parent, _, last = name.rpartition(".")
        if parent.endswith("stamp") and last in ("sec", "secs"):
            stamp[name] = 1.0
        if parent.endswith("stamp") and last in ("nanosec", "nsecs"):
            stamp[name] = 1e-9
    if stamp:
        return stamp
    for name in names:
        says = name_says(name)
        if says.target != "t_s":
            continue
        unit = find_unit("s", says.unit) if says.unit else find_unit("s", "s") if name == "t_s" else None
        if unit is None:
            raise BadInput(f"the unit of the time {name!r} in the lines is not known; name it t_s, or 'time (ms)'")
        return {name: unit.factor}
    return {}
