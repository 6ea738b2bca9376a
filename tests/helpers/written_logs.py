"""Logs that tests write: CSV of a unit at rest or moved, ULog by its published format, bags by rosbags."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

RATE_HZ = 100.0
HEADER = "time (s),gyro_x (deg/s),gyro_y (deg/s),gyro_z (deg/s),temperature (degC)"


def at_rest(n: int = 400, *, seed: int = 1) -> np.ndarray:
    """Return time, three outputs and a temperature of a unit at rest, (n, 5)."""
    random = np.random.default_rng(seed)
    t_s = np.arange(n) / RATE_HZ
    rates = np.array([0.3, -0.2, 0.1]) + 0.05 * random.standard_normal((n, 3))
    return np.column_stack([t_s, rates, 25 + 0.01 * t_s])


def moved(n: int = 2000) -> np.ndarray:
    """Return what `at_rest` returns for a unit that a hand moves half of the time."""
    rows = at_rest(n)
    moving = slice(n // 4, 3 * n // 4)
    rows[moving, 1:4] += 80 * np.sin(2 * np.pi * 0.7 * rows[moving, :1])
    return rows


def csv_text(rows: np.ndarray, header: str = HEADER, separator: str = ",", decimal: str = ".") -> str:
    """Return rows as CSV."""
    lines = [header] + [separator.join(f"{value:.6f}".replace(".", decimal) for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def spiked_on_table() -> str:
    """Return a log of a rate table as CSV: z at five rates of 20 s each, with three spikes."""
    random = np.random.default_rng(5)
    rate = np.repeat([0.0, 20.0, -20.0, 40.0, -40.0], 400)
    output = 0.2 + 1.002 * rate + 0.05 * random.standard_normal(len(rate))
    output[[150, 950, 1700]] += 5.0
    lines = [f"{k / 20:.2f},{output[k]:.6f},{rate[k]:.1f},25.0" for k in range(len(rate))]
    return "\n".join(["time (s),gyro_z (deg/s),table_rate (deg/s),temperature (degC)", *lines]) + "\n"


def in_poses(n_poses: int = 9) -> np.ndarray:
    """Return time, outputs in deg/s and specific force in m/s2 of a unit that rests in poses between turns by hand."""
    random = np.random.default_rng(3)
    rates, forces = [], []
    for pose in range(n_poses):
        angle = 2 * np.pi * pose / n_poses
        gravity = 9.80665 * np.array([np.cos(angle), np.sin(angle), 0.0])
        for moving in (False, True):
            rates.append(0.05 * random.standard_normal((200, 3)) + (60.0 if moving else 0.0))
            forces.append(gravity + 0.02 * random.standard_normal((200, 3)))
    stacked = np.column_stack([np.concatenate(rates), np.concatenate(forces)])
    return np.column_stack([np.arange(len(stacked)) / RATE_HZ, stacked])


def _message(kind: str, body: bytes) -> bytes:
    return struct.pack("<HB", len(body), ord(kind)) + body


def write_ulog(path: Path, topics: Mapping[tuple[str, int], tuple[Sequence[str], np.ndarray]]) -> Path:
    """Write a ULog: each topic and instance has names of fields (the first: timestamp, us) and rows of their values.

    Header, then messages F (format), A (subscription) and D (data), as the ULog file format describes them.
    """
    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)]
    formats = {name: fields for (name, _), (fields, _) in topics.items()}
    for name, fields in formats.items():
        types = ";".join(["uint64_t timestamp", *(f"float {field}" for field in fields[1:])])
        parts.append(_message("F", f"{name}:{types};".encode()))
    parts.append(_message("I", bytes([len(key := "char[8] sys_uuid")]) + key.encode() + b"00ab12cd"))
    for number, (name, instance) in enumerate(topics):
        parts.append(_message("A", struct.pack("<BH", instance, number) + name.encode()))
    for number, (fields, rows) in enumerate(topics.values()):
        packing = f"<HQ{len(fields) - 1}f"
        parts += [_message("D", struct.pack(packing, number, int(row[0]), *row[1:])) for row in rows]
    path.write_bytes(b"".join(parts))
    return path


def resting_ulog(path: Path, n: int = 400, *, instances: int = 2) -> Path:
    """Write a ULog of a unit at rest: sensor_gyro of several instances, their outputs set 0.1 rad/s apart."""
    rows = at_rest(n)
    stamps = 1e6 * (10 + rows[:, :1])
    gyros = {
        ("sensor_gyro", each): (
            ("timestamp", "x", "y", "z", "temperature"),
            np.column_stack([stamps, np.radians(rows[:, 1:4]) + 0.1 * each, rows[:, 4]]),
        )
        for each in range(instances)
    }
    force = np.tile([0.0, 0.0, -9.80665], (n, 1))
    accel = {("sensor_accel", 0): (("timestamp", "x", "y", "z"), np.column_stack([stamps, force]))}
    return write_ulog(path, {**gyros, **accel})
