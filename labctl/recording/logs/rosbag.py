"""ROS 1 and ROS 2 bags as a table: the messages sensor_msgs/Imu of one topic, by rosbags.

Units: REP 103 and sensor_msgs/Imu (rad/s, m/s2); sensor_msgs/Temperature is in deg C.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labctl.errors import BadInput, BadRecording
from labctl.recording.data_files.damaged_files import parsed_by_library
from labctl.recording.importer import TableImporter, TableOptions
from labctl.recording.logs.recognition import MAX_LOG_BYTES, head_of, refuse_large
from labctl.recording.raw_table import RawColumn, RawTable
from labctl.recording.unread import Unread, refuse_unread

#: Sizes that no number of such a message has, but random bits do.
SMALLEST, LARGEST = 1e-30, 1e12
#: A time stamp that departs from those of its neighbours by more than this, against their arrival, is damaged, s.
MAX_APART_S = 1.0
#: Messages that a message is compared with: itself and two on either side.
NEIGHBOURS = 5


class Vector(Protocol):
    """A geometry_msgs/Vector3."""

    x: float
    y: float
    z: float


class Head(Protocol):
    """A std_msgs/Header."""

    frame_id: str


class ImuMessage(Protocol):
    """A sensor_msgs/Imu, as rosbags gives it."""

    header: Head
    orientation_covariance: NDArray[np.float64]
    angular_velocity: Vector
    angular_velocity_covariance: NDArray[np.float64]
    linear_acceleration: Vector
    linear_acceleration_covariance: NDArray[np.float64]


def is_damaged(message: ImuMessage) -> bool:
    """Return whether the numbers or the name of the frame of a message are none that a driver writes."""
    numbers = np.concatenate([
        message.orientation_covariance, message.angular_velocity_covariance, message.linear_acceleration_covariance,
        [getattr(each, axis) for each in (message.angular_velocity, message.linear_acceleration) for axis in "xyz"],
    ])  # fmt: skip
    size = np.abs(numbers)
    odd = np.isinf(size) | (size > LARGEST) | ((size > 0) & (size < SMALLEST))
    return bool(odd.any()) or not message.header.frame_id.isprintable()


def with_damaged_times(
    damaged: NDArray[np.bool_], at_ns: NDArray[np.int64], arrived_ns: NDArray[np.int64], values: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which messages are damaged, (n,): also those whose time is none, or whose values, (n, 6), are all 0."""
    is_wrong = damaged | ((at_ns == 0) & (np.median(at_ns) != 0))
    empty = ~values.any(axis=1)
    if np.mean(empty) < 0.5:  # else the unit has no other output
        is_wrong |= empty
    if len(at_ns) >= NEIGHBOURS:
        late_s = (at_ns - arrived_ns) / NS
        padded = np.pad(late_s, NEIGHBOURS // 2, mode="edge")
        usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, NEIGHBOURS), axis=1)
        is_wrong |= np.abs(late_s - usual) > MAX_APART_S
    return is_wrong


def unread_messages(damaged: NDArray[np.bool_], arrived_ns: NDArray[np.int64], n_stated: int) -> Unread | None:
    """Return what of the `n_stated` messages of a topic was not found or is damaged; None where nothing is."""
    lost = max(n_stated - len(damaged), 0)
    if not lost and not damaged.any():
        return None
    t_s = (arrived_ns - arrived_ns[0]) / NS if len(arrived_ns) else np.zeros(0)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], damaged, [False]]).astype(np.int8)))
    places = [
        f"messages {first + 1} to {end} ({t_s[first]:.3f} s to {t_s[end - 1]:.3f} s)"
        for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]
    if lost:
        place = f"{lost} of the {n_stated} messages that its index states are not there"
        if len(t_s) > 1:
            gap = int(np.argmax(np.diff(t_s)))
            place += f"; the longest gap is from {t_s[gap]:.3f} s to {t_s[gap + 1]:.3f} s"
            place += f", the last message at {t_s[-1]:.3f} s"
        places.append(place)
    return Unread((lost + int(damaged.sum())) / max(n_stated, len(damaged), 1), tuple(places))


ROS1 = b"#ROSBAG V2.0"
MCAP = b"\x89MCAP0\r\n"
METADATA = "metadata.yaml"
IMU, TEMPERATURE = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"

NS = 1_000_000_000

Array = NDArray[np.float64]


class BagOptions(TableOptions):
    """Which of a bag's topics to take."""

    topic: str | None = Field(default=None, max_length=200)  #: None: the only one of sensor_msgs/Imu
    temperature: str | None = Field(default=None, max_length=200)  #: None: the only one of sensor_msgs/Temperature


def probe(path: Path) -> float:
    """Return 1 for a ROS 1 bag, a ROS 2 folder with metadata.yaml, or one of its data files."""
    if path.is_dir():
        metadata = path / METADATA
        return float(metadata.is_file() and b"rosbag2_bagfile_information" in metadata.read_bytes()[:4096])
    if not path.is_file():
        return 0.0
    with path.open("rb") as file:
        head = file.read(len(ROS1))
    return float(head == ROS1 or head.startswith(MCAP) or path.suffix == ".db3")


def read(path: Path, options: BagOptions) -> RawTable:
    """Return time, output, specific force and temperature of one topic; raises BadRecording, BadInput."""
    for each in [path] if path.is_file() else sorted(path.iterdir()):
        refuse_large(each, MAX_LOG_BYTES)
    if path.is_file() and head_of(path).startswith(ROS1) and path.suffix != ".bag":
        raise BadRecording(f"{path}: a ROS 1 bag whose name does not end in .bag; rename it")
    with _opened(path) as bag:
        topic = _topic(path, bag, options.topic, IMU, "topic")
        assert topic is not None
        imu, unread = _imu(bag, topic)
        refuse_unread(path, unread)
        thermometer = _topic(path, bag, options.temperature, TEMPERATURE, "temperature")
        if thermometer is not None and len(imu["stamp"]):
            imu["temperature"] = _temperature(bag, thermometer, imu["stamp"])
    if not len(imu["stamp"]):
        raise BadRecording(f"{path}: topic {topic} holds no message; take another bag, or another topic")
    return _table(path, topic, imu, unread)


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Yield the reader of a bag; raises BadRecording for whatever broken bytes lead it to."""
    from rosbags.highlevel import AnyReader  # noqa: PLC0415  0.3 s that only bags need
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415  as above

    advice = "run `rosbag reindex` or `ros2 bag reindex` on it, or record again"
    with (
        parsed_by_library(path, "ROS bag", advice),
        AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag,
    ):
        yield bag


def _topic(path: Path, bag: Any, topic: str | None, kind: str, option: str) -> str | None:
    """Return the topic of a kind of message; None where the bag has no temperature."""
    topics = sorted(name for name, info in bag.topics.items() if info.msgtype == kind)
    if topic is not None:
        if topic not in topics:
            raise BadInput(
                f"{path}: the bag has no topic {topic!r} of {kind}; choose one of {', '.join(topics) or 'none'}"
            )
        return topic
    if len(topics) == 1:
        return str(topics[0])
    if kind == TEMPERATURE:
        return None
    if not topics:
        names = ", ".join(f"{name} ({info.msgtype})" for name, info in list(bag.topics.items())[:10])
        raise BadRecording(
            f"{path}: the bag has no topic of {kind} (its topics: {names or 'none'}); record a topic with the "
            "output of the gyro"
        )
    raise BadInput(
        f"{path}: the topics {' and '.join(topics)} are all of {kind}; choose one with --option {option}=NAME"
    )


def _messages(bag: Any, topic: str) -> Iterator[tuple[int, int, Any]]:
    """Yield the time of the head of each message and of its arrival, ns since 1970, and the message."""
    connections = [each for each in bag.connections if each.topic == topic]
    for connection, arrived_ns, raw in bag.messages(connections=connections):
        message = bag.deserialize(raw, connection.msgtype)
        stamp = message.header.stamp
        yield stamp.sec * NS + stamp.nanosec, int(arrived_ns), message


def _imu(bag: Any, topic: str) -> tuple[dict[str, NDArray[Any]], Unread | None]:
    """Return the columns of the messages that are sound, and what of the topic could not be read."""
    rows = [
        (
            at_ns, arrived_ns, is_damaged(message),
            message.angular_velocity.x, message.angular_velocity.y, message.angular_velocity.z,
            message.linear_acceleration.x, message.linear_acceleration.y, message.linear_acceleration.z,
            message.linear_acceleration_covariance[0],
        )
        for at_ns, arrived_ns, message in _messages(bag, topic)
    ]  # fmt: skip
    whole = np.array([row[3:] for row in rows], dtype=np.float64).reshape(-1, 7)
    at_ns, arrived_ns = (np.array([row[k] for row in rows], dtype=np.int64) for k in (0, 1))
    damaged = with_damaged_times(np.array([row[2] for row in rows], dtype=np.bool_), at_ns, arrived_ns, whole[:, :6])
    unread = unread_messages(damaged, arrived_ns, int(bag.topics[topic].msgcount))
    stamps, whole = np.where(at_ns == 0, arrived_ns, at_ns)[~damaged], whole[~damaged]
    names = ("gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z")
    columns: dict[str, NDArray[Any]] = {"stamp": stamps}
    columns.update({name: whole[:, index] for index, name in enumerate(names)})
    if (whole[:, 6] == -1).any():  # sensor_msgs/Imu: -1 says that the sensor has no such output
        columns = {name: values for name, values in columns.items() if not name.startswith("accel_")}
    return columns, unread


def _temperature(bag: Any, topic: str, at_ns: NDArray[np.int64]) -> Array:
    rows = [
        (((head_ns or arrived_ns) - int(at_ns[0])) / NS, message.temperature)
        for head_ns, arrived_ns, message in _messages(bag, topic)
    ]
    times, values = np.array(rows, dtype=np.float64).reshape(-1, 2).T
    return np.interp((at_ns - at_ns[0]) / NS, times, values) if rows else np.full(len(at_ns), np.nan)


_TARGETS = {
    "time": ("t_s", "s"), "gyro_x": ("gyro_x", "rad/s"), "gyro_y": ("gyro_y", "rad/s"), "gyro_z": ("gyro_z", "rad/s"),
    "accel_x": ("accel_x_g", "m/s2"), "accel_y": ("accel_y_g", "m/s2"), "accel_z": ("accel_z_g", "m/s2"),
    "temperature": ("temperature_c", "deg C"),
}  # fmt: skip


def _table(path: Path, topic: str, imu: dict[str, NDArray[Any]], unread: Unread | None) -> RawTable:
    at_ns = imu.pop("stamp")
    if not np.isfinite(imu.get("temperature", np.zeros(1))).all():
        del imu["temperature"]
    columns = {"time": (at_ns - at_ns[0]) / NS, **imu}
    raw = {name: RawColumn(name, values, unit=_TARGETS[name][1]) for name, values in columns.items()}
    return RawTable(
        path, raw, len(columns["time"]),
        targets={name: _TARGETS[name][0] for name in raw},
        facts={"notes": f"ROS bag, topic {topic}"},
        started_at=datetime(1970, 1, 1, tzinfo=UTC) + timedelta(microseconds=int(at_ns[0]) // 1000),
        unread=unread,
    )  # fmt: skip


IMPORTER = TableImporter("a ROS bag", probe, read, BagOptions)
