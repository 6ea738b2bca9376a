"""Logs that were damaged on their way: ULog, ROS bags and Parquet files of a unit at rest, with a few bytes changed."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

RATE_HZ, READINGS = 100.0, 300
GRAVITY_MS2 = 9.80665
STARTED_S = 1_700_000_000
#: Numbers that lengths, offsets and counts are set to: nothing, just too much, far too much, negative.
EXTREMES = (0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 2**63 - 1, 2**64 - 1)
#: Half of all damage is this near to an end of the file, bytes: there the lengths, formats and footers are.
NEAR_END = 1024


@dataclass(frozen=True)
class DamagedLog:
    """One file, and what was done to it."""

    kind: str
    name: str
    damage: str
    content: bytes


def rows(seed: int = 1) -> np.ndarray:
    """Return time (s), three rates (rad/s) and a temperature (deg C) of a unit at rest, (n, 5)."""
    random = np.random.default_rng(seed)
    t_s = np.arange(READINGS) / RATE_HZ
    rates_rps = np.radians(np.array([0.3, -0.2, 0.1]) + 0.05 * random.standard_normal((READINGS, 3)))
    return np.column_stack([t_s, rates_rps, 25 + 0.01 * t_s])


def _ulog(_: Path) -> bytes:
    """Return a log of sensor_gyro and sensor_accel as the ULog file format describes it."""

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)]
    parts.append(message("F", b"sensor_gyro:uint64_t timestamp;float x;float y;float z;float temperature;"))
    parts.append(message("F", b"sensor_accel:uint64_t timestamp;float x;float y;float z;"))
    parts.append(message("I", bytes([len(b"char[8] sys_uuid")]) + b"char[8] sys_uuid" + b"00ab12cd"))
    parts += [message("A", struct.pack("<BH", 0, n) + name) for n, name in enumerate((b"sensor_gyro", b"sensor_accel"))]
    for t_s, x, y, z, warm in rows():
        stamp_us = round(1e6 * (10 + t_s))
        parts.append(message("D", struct.pack("<HQ4f", 0, stamp_us, x, y, z, warm)))
        parts.append(message("D", struct.pack("<HQ3f", 1, stamp_us, 0.0, 0.0, -GRAVITY_MS2)))
    return b"".join(parts)


def _ros1(folder: Path) -> bytes:
    from rosbags.rosbag1 import Writer

    path = folder / "log.bag"
    _fill(Writer(path), ros1=True)
    return path.read_bytes()


def _ros2(storage: str) -> Callable[[Path], bytes]:
    def written(folder: Path) -> bytes:
        from rosbags.rosbag2 import StoragePlugin, Writer

        path = folder / storage
        _fill(Writer(path, version=9, storage_plugin=StoragePlugin[storage]), ros1=False)
        return next(each for each in path.iterdir() if each.suffix in {".db3", ".mcap"}).read_bytes()

    return written


def _fill(writer: object, *, ros1: bool) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    types, imu = store.types, "sensor_msgs/msg/Imu"
    vector, none = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    pack = store.serialize_ros1 if ros1 else store.serialize_cdr
    with writer as opened:  # type: ignore[attr-defined]
        connection = opened.add_connection("/imu", imu, typestore=store)
        for number, (t_s, x, y, z, _) in enumerate(rows()):
            ns = round(t_s * 1e9)
            stamp = types["builtin_interfaces/msg/Time"](sec=STARTED_S + ns // 10**9, nanosec=ns % 10**9)
            head = types["std_msgs/msg/Header"](stamp=stamp, frame_id="imu", **({"seq": number} if ros1 else {}))
            message = types[imu](
                header=head, orientation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
                orientation_covariance=none, angular_velocity=vector(x, y, z), angular_velocity_covariance=none,
                linear_acceleration=vector(0.0, 0.0, GRAVITY_MS2), linear_acceleration_covariance=none,
            )  # fmt: skip
            opened.write(connection, STARTED_S * 10**9 + ns, pack(message, imu))


def _parquet(_: Path) -> bytes:
    names = ["time [s]", "gyro_x [rad/s]", "gyro_y [rad/s]", "gyro_z [rad/s]", "temp [degC]"]
    made = io.BytesIO()
    pq.write_table(pa.table(dict(zip(names, rows().T, strict=True))), made, row_group_size=READINGS // 3)
    return made.getvalue()


#: Kind -> the name that its files have, and what writes a whole one with a folder for what it needs.
KINDS: Mapping[str, tuple[str, Callable[[Path], bytes]]] = {
    "ULog": ("log.ulg", _ulog),
    "ROS 1 bag": ("log.bag", _ros1),
    "ROS 2 bag, MCAP": ("log.mcap", _ros2("MCAP")),
    "ROS 2 bag, SQLite": ("log.db3", _ros2("SQLITE3")),
    "Parquet": ("log.parquet", _parquet),
}


def whole_logs(folder: Path) -> dict[str, bytes]:
    """Return an undamaged file of each kind; `folder` is for what is written on the way."""
    return {kind: write(folder) for kind, (_, write) in KINDS.items()}


def damaged_logs(whole: Mapping[str, bytes], number: int, seed: int) -> Iterator[DamagedLog]:
    """Yield so many damaged files of each kind, the kinds in turn; the same ones for the same seed."""
    random = np.random.default_rng(seed)
    for _ in range(number):
        for kind, content in whole.items():
            changed, said = bytearray(content), []
            for _ in range(int(random.integers(1, 4))):
                name = str(random.choice(list(DAMAGES)))
                at = _place(len(changed), random)
                DAMAGES[name](changed, at, random)
                said.append(f"{name} at {at}")
            yield DamagedLog(kind, KINDS[kind][0], ", ".join(said), bytes(changed))


def _place(size: int, random: np.random.Generator) -> int:
    near = min(NEAR_END, size)
    where = random.choice(["begin", "end", "anywhere", "anywhere"])
    if where == "begin":
        return int(random.integers(0, near))
    if where == "end":
        return int(random.integers(size - near, size))
    return int(random.integers(0, size))


def _flip_bit(content: bytearray, at: int, random: np.random.Generator) -> None:
    content[at] ^= 1 << int(random.integers(0, 8))


def _random_bytes(content: bytearray, at: int, random: np.random.Generator) -> None:
    size = int(random.integers(1, 32))
    content[at : at + size] = random.bytes(len(content[at : at + size]))


def _extreme(content: bytearray, at: int, random: np.random.Generator) -> None:
    size = int(random.choice([1, 2, 4, 8]))
    value = int(EXTREMES[int(random.integers(0, len(EXTREMES)))]) & ((1 << 8 * size) - 1)
    content[at : at + size] = value.to_bytes(size, "little")[: len(content[at : at + size])]


def _cut(content: bytearray, at: int, _: np.random.Generator) -> None:
    del content[max(at, 64) :]


def _drop(content: bytearray, at: int, random: np.random.Generator) -> None:
    if len(content) > 2 * NEAR_END:
        del content[at : at + int(random.integers(1, 512))]


def _repeat(content: bytearray, at: int, random: np.random.Generator) -> None:
    content[at:at] = content[at : at + int(random.integers(1, 512))]


def _clear(content: bytearray, at: int, random: np.random.Generator) -> None:
    size = int(random.integers(1, 512))
    content[at : at + size] = bytes(len(content[at : at + size]))


DAMAGES: Mapping[str, Callable[[bytearray, int, np.random.Generator], None]] = {
    "a flipped bit": _flip_bit,
    "random bytes": _random_bytes,
    "an extreme number": _extreme,
    "cut off": _cut,
    "bytes dropped": _drop,
    "bytes repeated": _repeat,
    "zeros": _clear,
}
