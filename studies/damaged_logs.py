"""Files that were damaged on their way: logs of a unit at rest and recordings, with a few bytes or words changed.

ULog, ROS bags (also with packed chunks), Parquet and CSV files are imported as logs, the CSV file by a map of its
columns; a recording in the interchange format is three files, of which one is damaged.
"""

from __future__ import annotations

import io
import re
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from uuid import uuid4

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
    column_map: str = ""
    beside: Mapping[str, bytes] = field(default_factory=dict)  #: the whole files of its recording; empty for a log

    @property
    def path(self) -> str:
        """Where the file is sent to be imported."""
        return "/api/recordings" if self.beside else "/api/recordings/logs"

    @property
    def parts(self) -> dict[str, Any]:
        """What is sent there, as arguments of an httpx request."""
        if self.beside:
            return {"files": [("files", each) for each in {**self.beside, self.name: self.content}.items()]}
        data = {"option": "serial=DAMAGED", "column_map": self.column_map}
        return {"files": {"file": (self.name, self.content)}, "data": data}


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


#: Packs the content of a chunk; what a writer of bags does by itself.
Packing = Callable[[bytes], bytes]


def ros1(packed: str = "", packing: Packing | None = None) -> Callable[[Path], bytes]:
    """Return what writes a ROS 1 bag whose chunks are packed by `bz2` or `lz4`; `packing` takes the writer's place."""

    def written(folder: Path) -> bytes:
        from rosbags.rosbag1 import Writer

        path = folder / f"{uuid4().hex}.bag"
        writer = Writer(path)
        if packed:
            writer.set_compression(Writer.CompressionFormat[packed.upper()])
        writer.compressor = packing or writer.compressor
        fill(writer, ros1=True)
        return path.read_bytes()

    return written


def ros2(storage: str, *, packed: bool = False, packing: Packing | None = None) -> Callable[[Path], bytes]:
    """Return what writes the file of a ROS 2 bag; the chunks of an MCAP file may be packed by zstd."""

    def written(folder: Path) -> bytes:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

        path = folder / uuid4().hex
        writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage])
        if packed:
            writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        fill(writer, ros1=False, packing=packing)
        return next(each for each in path.iterdir() if each.suffix in {".db3", ".mcap"}).read_bytes()

    return written


def fill(writer: object, *, ros1: bool, packing: Packing | None = None) -> None:
    """Write the messages of a unit at rest into a bag."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    types, imu = store.types, "sensor_msgs/msg/Imu"
    vector, none = types["geometry_msgs/msg/Vector3"], np.zeros(9)
    pack = store.serialize_ros1 if ros1 else store.serialize_cdr
    with writer as opened:  # type: ignore[attr-defined]
        if packing is not None and not ros1:
            opened.storage.compressor = packing
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
    return parquet_of(dict(zip(names, rows().T, strict=True)), row_group_size=READINGS // 3)


def _csv(_: Path) -> bytes:
    lines = [";".join(f"{value:.6g}".replace(".", ",") for value in row) for row in rows()]
    return "\n".join(["unit at rest", "time;x;y;z;temp", *lines, ""]).encode("cp1252")


CSV_MAP = """
motion = "rest"
[file]
separator = ";"
decimal = ","
header = 2
data = 3
encoding = "cp1252"
[columns]
t_s = {from = "time", unit = "s"}
gyro_x = {from = "x", unit = "rad/s"}
gyro_y = {from = "y", unit = "rad/s"}
gyro_z = {from = "z", unit = "rad/s"}
temperature_c = {from = "temp", unit = "deg C"}
"""
_HEAD = b"""format = "labctl-recording/1"
serial = "DAMAGED"
model = "a gyro"
axes = ["z"]
kind = "samples"
started_at = 2026-01-05T08:00:00Z
sample_rate_hz = 10.0
technology = "mems"
[output.z]
unit = "count"
offset = 3.0
scale = 0.5
[datasheet]
bias_stability_dps = 0.002
"""


def _samples(_: Path) -> bytes:
    number, t_s = np.repeat(np.arange(1, 7), READINGS // 6), np.arange(READINGS) / RATE_HZ
    gyro_z = rows()[:, 3] + number
    columns = {"dataset": number, "t_s": t_s, "table_rate_dps": 1.0 * number, "temperature_c": 25 + 0 * t_s}
    return parquet_of(columns | {"gyro_z": gyro_z, "position": np.where(number > 3, "z", "-z")})


def _environment(_: Path) -> bytes:
    t_s = np.arange(0.0, 4.0)
    return parquet_of({"t_s": t_s, "temperature_c": 25 + t_s, "chamber_c": 25 + t_s})


def parquet_of(columns: Mapping[str, object], **options: object) -> bytes:
    """Return a Parquet file of columns; `options` as those of `pyarrow.parquet.write_table`."""
    made = io.BytesIO()
    pq.write_table(pa.table(dict(columns)), made, **options)
    return made.getvalue()


#: The files of a recording in the interchange format.
RECORDING: Mapping[str, Callable[[Path], bytes]] = {
    "recording.toml": lambda _: _HEAD,
    "samples.parquet": _samples,
    "environment.parquet": _environment,
}

#: Kind -> the name that its files have, and what writes a whole one with a folder for what it needs.
LOGS: Mapping[str, tuple[str, Callable[[Path], bytes]]] = {
    "ULog": ("log.ulg", _ulog),
    "ROS 1 bag": ("log.bag", ros1()),
    "ROS 1 bag, lz4": ("log.bag", ros1("lz4")),
    "ROS 1 bag, bz2": ("log.bag", ros1("bz2")),
    "ROS 2 bag, MCAP": ("log.mcap", ros2("MCAP")),
    "ROS 2 bag, MCAP, zstd": ("log.mcap", ros2("MCAP", packed=True)),
    "ROS 2 bag, SQLite": ("log.db3", ros2("SQLITE3")),
    "Parquet": ("log.parquet", _parquet),
    "CSV with a map": ("log.csv", _csv),
}
KINDS: Mapping[str, tuple[str, Callable[[Path], bytes]]] = {
    **LOGS, **{f"interchange, {name}": (name, write) for name, write in RECORDING.items()},
}  # fmt: skip


def whole_logs(folder: Path) -> dict[str, bytes]:
    """Return an undamaged file of each kind; `folder` is for what is written on the way."""
    return {kind: write(folder) for kind, (_, write) in KINDS.items()}


def sent_as(kind: str, whole: Mapping[str, bytes], damage: str, content: bytes) -> DamagedLog:
    """Return a file of a kind with what is sent beside it."""
    name = KINDS[kind][0]
    beside = {name: whole[f"interchange, {name}"] for name in RECORDING} if kind.startswith("interchange") else {}
    return DamagedLog(kind, name, damage, content, CSV_MAP if kind == "CSV with a map" else "", beside)


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
            yield sent_as(kind, whole, ", ".join(said), bytes(changed))


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
    del content[max(at, 64) : at + int(random.integers(1, 512))]


def _repeat(content: bytearray, at: int, random: np.random.Generator) -> None:
    content[at:at] = content[at : at + int(random.integers(1, 512))]


def _clear(content: bytearray, at: int, random: np.random.Generator) -> None:
    size = int(random.integers(1, 512))
    content[at : at + size] = bytes(len(content[at : at + size]))


def _swap(content: bytearray, at: int, random: np.random.Generator) -> None:
    other = _place(len(content), random)
    size = min(int(random.integers(1, 512)), abs(other - at), len(content) - max(at, other))
    content[at : at + size], content[other : other + size] = content[other : other + size], content[at : at + size]


def _other_word(content: bytearray, at: int, random: np.random.Generator) -> None:
    """Put another word or number in the place of the next one: a name, a type, a length in a text, a figure."""
    if found := re.compile(rb"[A-Za-z0-9_.+-]+").search(content, at):
        content[found.start() : found.end()] = WORDS[int(random.integers(0, len(WORDS)))]


#: What `another word` puts there.
WORDS = (
    b"", b"nan", b"inf", b"-1", b"0", b"1e308", b"1e999", b"99999999999999999999", b"9" * 5000, b"true", b"null", b"x",
    b"float[4294967295]", b"timestamp", b"none", b"lz4", b"zstd", b"1970-01-01T00:00:00Z", b"9999-12-31T23:59:59Z",
    b"\xff\xfe", b"[" * 3000, b'"', b"\x00",
)  # fmt: skip
DAMAGES: Mapping[str, Callable[[bytearray, int, np.random.Generator], None]] = {
    "a flipped bit": _flip_bit,
    "random bytes": _random_bytes,
    "an extreme number": _extreme,
    "cut off": _cut,
    "bytes dropped": _drop,
    "bytes repeated": _repeat,
    "zeros": _clear,
    "bytes swapped": _swap,
    "another word": _other_word,
}
