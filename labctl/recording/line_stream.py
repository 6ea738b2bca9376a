"""From the bytes of a stream of lines to readings; what cannot be read is counted, and the first of it is quoted."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadInput
from labctl.recording.checks import POSSIBLE
from labctl.recording.column_map.conversion import LARGEST_RATE_DPS
from labctl.recording.column_map.names import name_says
from labctl.recording.column_map.units import QUANTITIES, find_unit, names_of, unit_of_target
from labctl.recording.columns import DEVICE_S

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
        field = _field(name)
        if field is None:
            continue
        if field.target in fields:
            raise BadInput(
                f"two values of a line are {field.target}: {fields[field.target].name!r} and {name!r}; name the "
                "columns with --columns, and the one to leave out '-'"
            )
        fields[field.target] = field
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


#: A line is not longer than this, bytes: what is, is no line of readings.
LONGEST_LINE = 1 << 16
#: So many lines in a row whose time does not rise: the sender began anew.
BACKWARDS = 20
#: A damaged line is quoted up to here.
QUOTED = 80
_SEPARATORS = (",", ";", "\t")


@dataclass(frozen=True)
class DecodedLines:
    """n readings of some bytes."""

    #: Of a recording, (n,) each: t_s from the first line on, and device_s as the lines state it where they do.
    columns: dict[str, NDArray[np.generic]]
    damaged: int  #: lines that are no reading
    example: str  #: what is wrong with the first of them; "" without one

    def __len__(self) -> int:
        return len(self.columns.get("t_s", ()))


class LineDecoder:
    """Lines of one stream. The first line decides whether they are JSON or CSV, and names the values.

    `names`: of the values of a CSV line, where the lines have no header; `rate_hz`: readings per second, for lines
    without a time. Raises BadInput for names that do not suffice, as `layout_of` does.
    """

    def __init__(self, names: Sequence[str] = (), rate_hz: float | None = None) -> None:
        if rate_hz is not None and not (rate_hz > 0 and math.isfinite(rate_hz)):
            raise BadInput(f"--rate {rate_hz:g} Hz: give the readings per second, above 0")
        self._names = tuple(name.strip() for name in names)
        self._rate_hz = rate_hz
        self._layout: LineLayout | None = self._checked(layout_of(self._names)) if self._names else None
        self._separator = ""
        self._rest = b""
        self._first: dict[str, float] = {}
        self._last_s = -math.inf
        self._count = self._backwards = 0

    def feed(self, data: bytes) -> DecodedLines:
        """Return the readings of the lines that these bytes end; raises BadInput for lines that cannot be used at all.

        A line that is not whole yet is kept for the next bytes.
        """
        *lines, self._rest = (self._rest + data).split(b"\n")
        rows: list[list[float]] = []
        damaged, example = 0, ""
        if len(self._rest) > LONGEST_LINE:
            lines, self._rest = [*lines, self._rest], b""
        for line in lines:
            try:
                row = self._row(line)
            except _Damaged as error:
                damaged += 1
                example = example or f"{error}: {line[:QUOTED].decode('utf-8', errors='replace')!r}"
                continue
            if row is not None:
                rows.append(row)
        return DecodedLines(self._columns(rows), damaged, example)

    def _row(self, line: bytes) -> list[float] | None:
        """Return time and values of a line; None for a line that is no reading by intent: empty, comment, header."""
        text = line.decode("utf-8", errors="replace").strip().lstrip("\ufeff")
        if not text or text.startswith("#") or set(text) == {"-"}:  # `ros2 topic echo` puts --- between messages
            return None
        values = self._json(text) if text.startswith("{") else self._csv(text)
        if values is None:
            return None
        layout = self._layout
        assert layout is not None
        t_s, stamp_s = self._time(layout, values)
        row = [t_s, stamp_s]
        for field in layout.fields:
            value = field.factor * values.get(field.name, math.nan) + field.zero
            low, high = field.limits
            if not low <= value <= high:  # also true for NaN
                raise _Damaged(f"{field.name} is missing or no possible number")
            if field.target == "valid" and value not in (0.0, 1.0):
                raise _Damaged(f"{field.name} is neither 0 nor 1")
            row.append(value)
        self._last_s, self._count = t_s, self._count + 1
        return row

    def _json(self, text: str) -> Mapping[str, float]:
        try:
            document = json.loads(text)
        except (ValueError, RecursionError):
            raise _Damaged("no JSON") from None
        message = document.get("msg")
        values = dict(_flat(message if isinstance(message, dict) else document))  # rosbridge wraps a message
        if self._layout is None:
            self._layout = self._checked(layout_of(tuple(values)))
        return values

    def _csv(self, text: str) -> Mapping[str, float] | None:
        if not self._separator:
            self._separator = max(_SEPARATORS, key=text.count)
        words = [word.strip().strip('"') for word in text.split(self._separator)]
        numbers = [_number(word) for word in words]
        if self._layout is None:
            names = ROS_IMU if len(words) == len(ROS_IMU) and not math.isnan(numbers[0]) else words
            if names is words and not all(map(math.isnan, numbers)):
                raise BadInput(
                    f"the first line of the stream is no header: {text[:QUOTED]!r}; name its values with --columns, "
                    "such as t_s,gyro_x,gyro_y,gyro_z,accel_x_g,accel_y_g,accel_z_g"
                )
            self._layout = self._checked(layout_of(names))
        names = self._layout.names
        if tuple(words) == names:
            return None
        if len(words) != len(names):
            raise _Damaged(f"{len(words)} values where {len(names)} are expected")
        return dict(zip(names, numbers, strict=True))

    def _checked(self, layout: LineLayout) -> LineLayout:
        if not layout.time and self._rate_hz is None:
            raise BadInput(
                "the lines have no time; add a column t_s (s) to them, or state their number per second with --rate"
            )
        return layout

    def _time(self, layout: LineLayout, values: Mapping[str, float]) -> tuple[float, float]:
        """Return the time since the first line, s, and the time as the line states it, s; raises BadInput."""
        if not layout.time:
            return self._count / (self._rate_hz or 1.0), math.nan
        stamps = {name: values.get(name, math.nan) for name in layout.time}
        if not all(map(math.isfinite, stamps.values())):
            raise _Damaged("the time is missing")
        if not self._first:
            self._first = stamps
        t_s = sum((value - self._first[name]) * layout.time[name] for name, value in stamps.items())
        if t_s > self._last_s:
            self._backwards = 0
            return t_s, sum(value * layout.time[name] for name, value in stamps.items())
        self._backwards += 1
        if self._backwards >= BACKWARDS:
            raise BadInput(
                f"the time of the lines went back from {self._last_s:.3f} s to {t_s:.3f} s and stays there: the sender "
                "has begun anew; start the calibration again"
            )
        raise _Damaged(f"the time {t_s:.6f} s does not follow {self._last_s:.6f} s")

    def _columns(self, rows: list[list[float]]) -> dict[str, NDArray[np.generic]]:
        if self._layout is None:
            return {}
        targets = ["t_s", DEVICE_S, *(field.target for field in self._layout.fields)]
        table = np.array(rows, dtype=np.float64).reshape(len(rows), len(targets))
        return {
            target: table[:, k].astype(np.int64 if target == "valid" else np.float64)
            for k, target in enumerate(targets)
            if target != DEVICE_S or self._layout.time
        }


class _Damaged(Exception):
    """A line that is no reading."""


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan


def _flat(document: Mapping[str, object], above: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers of nested objects by their path, such as angular_velocity.x."""
    for name, value in document.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{above}{name}.")
        elif isinstance(value, int | float):
            yield above + name, float(value)
