"""Bags that tests write by rosbags, and what an import makes of a log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from labctl.recording import Recording
from labctl.services.recordings.importers import read_with, surest
from tests.helpers.written_logs import at_rest

IMU, THERMOMETER = "sensor_msgs/msg/Imu", "sensor_msgs/msg/Temperature"
ROWS = at_rest()


def imported(path: Path, **options: str) -> Recording:
    """Return what the surest importer makes of a log."""
    return read_with(surest(path), path, options)


def bag(path: Path, topics: tuple[str, ...] = ("/imu/raw",), rows: np.ndarray = ROWS, *, force: bool = True) -> Path:
    """Write a ROS 1 bag for a name that ends in .bag, else a ROS 2 bag: outputs in deg/s and a temperature."""
    ros1 = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    t = store.types
    writer = Writer1(path) if ros1 else Writer2(path, version=9)
    stamp_s = 1_700_000_000
    with writer:
        send = {name: writer.add_connection(name, IMU, typestore=store) for name in topics}
        warm = writer.add_connection("/temp", THERMOMETER, typestore=store)
        for row in rows:
            ns = round(row[0] * 1e9)
            stamp = t["builtin_interfaces/msg/Time"](sec=stamp_s + ns // 10**9, nanosec=ns % 10**9)
            seq = {"seq": 0} if ros1 else {}
            head = t["std_msgs/msg/Header"](stamp=stamp, frame_id="imu", **seq)
            vector = t["geometry_msgs/msg/Vector3"]
            none = np.zeros(9)
            no_force = np.array([-1.0, *none[1:]])
            message = t[IMU](
                header=head, orientation=t["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
                orientation_covariance=none,
                angular_velocity=vector(*np.radians(row[1:4])), angular_velocity_covariance=none,
                linear_acceleration=vector(0.0, 0.0, 9.80665),
                linear_acceleration_covariance=none if force else no_force,
            )  # fmt: skip
            made = t[THERMOMETER](header=head, temperature=float(row[4]), variance=0.0)
            pack = store.serialize_ros1 if ros1 else store.serialize_cdr
            at = stamp_s * 10**9 + ns + 5_000_000
            for connection in send.values():
                writer.write(connection, at, pack(message, IMU))
            writer.write(warm, at, pack(made, THERMOMETER))
    return path
