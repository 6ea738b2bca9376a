"""Figures of recordings and versions from the database file alone: sqlite3, NumPy and blosc2, nothing of labctl.

Readings are unpacked, averaged and compared with rate and model by formulas written here from the documentation. Only
models of bias, scale factor and misalignment over temperature are known, of units whose mountings are those of the
three axes.
"""

from __future__ import annotations

import itertools
import json
import sqlite3
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import blosc2
import numpy as np

Array = np.ndarray
#: Rate of the Earth (WGS 84).
EARTH_DPS = float(np.degrees(7.292115e-5))


@dataclass(frozen=True)
class Sets:
    """Complete data sets of a recording, in order of their numbers."""

    number: Array  #: (n,)
    table_rate_dps: Array  #: (n,)
    rate_dps: Array  #: (n, 3) of the unit about its x, y and z
    temperature_c: Array  #: (n,)
    output_dps: dict[str, Array]  #: axis -> (n,)
    std: dict[str, Array]  #: channel -> (n,), in its own unit; empty for points
    mean: dict[str, Array]  #: the same of the mean
    readings: Array  #: (n,)


def sets_of(database: Path, recording: int) -> Sets:
    """Return the complete data sets of a recording."""
    with sqlite3.connect(database) as file:
        info, channels = (json.loads(text) for text in file.execute(
            "select info, channels from recordings where id = ?", (recording,)
        ).fetchone())  # fmt: skip
        heads = file.execute(
            "select number, position, table_rate_dps, n from data_sets where recording_id = ? and state = 'complete' "
            "order by number", (recording,),
        ).fetchall()  # fmt: skip
        blocks = file.execute(
            "select number, n, data from sample_blocks where recording_id = ? order by number, seq", (recording,)
        ).fetchall()
    number = np.array([head[0] for head in heads])
    earth_dps = 0.0 if info["latitude_deg"] is None else EARTH_DPS * np.sin(np.radians(info["latitude_deg"]))
    rate = np.array([about(position) * (dps + earth_dps) for _, position, dps, _ in heads])
    if info["kind"] == "points":
        columns = unpacked(*blocks[0][1:])
        mean = {name: np.asarray(values, dtype=float) for name, values in columns.items() if values.dtype.kind != "U"}
        std: dict[str, Array] = {}
    else:
        raw = {n: joined([unpacked(*block[1:]) for block in blocks if block[0] == n]) for n in number.tolist()}
        mean, std = _moments(raw, channels, number)
    output = {}
    for axis in info["axes"]:
        law = info["output"].get(axis, {})
        output[axis] = (mean[f"gyro_{axis}"] - law.get("offset", 0.0)) / law.get("scale", 1.0)
    table_rate = np.array([head[2] for head in heads])
    return Sets(
        number, table_rate, rate, mean["temperature_c"], output, std, mean, np.array([head[3] for head in heads])
    )


def _moments(
    raw: dict[int, dict[str, Array]], channels: list[dict[str, Any]], number: Array
) -> tuple[dict[str, Array], dict[str, Array]]:
    mean: dict[str, list[float]] = {}
    std: dict[str, list[float]] = {}
    for n in number.tolist():
        valid = np.asarray(raw[n]["valid"], dtype=bool) if "valid" in raw[n] else slice(None)
        declared = {each["name"]: each for each in channels}
        for name in declared or {name for name in raw[n] if name.startswith(("gyro_", "temperature"))}:
            law = declared.get(name, {"offset": 0.0, "scale": 1.0})  # what was imported is stored in its unit
            values = law["offset"] + law["scale"] * np.asarray(raw[n][name], dtype=float)[valid]
            mean.setdefault(name, []).append(float(np.mean(values)))
            std.setdefault(name, []).append(float(np.std(values, ddof=1)))
    return ({name: np.array(each) for name, each in mean.items()}, {name: np.array(each) for name, each in std.items()})


def about(position: str) -> Array:
    """Return the table axis in the unit (3,): the axis that points along it, with its sign."""
    sign = -1.0 if position.startswith("-") else 1.0
    return sign * np.array([axis == position[-1] for axis in "xyz"], dtype=float)


def unpacked(n: int, data: bytes) -> dict[str, Array]:
    """Return the columns (n,) of a block."""
    (size,) = struct.unpack_from("<I", data)
    heads, lengths, effort = json.loads(data[4 : 4 + size])
    widths = sorted({head[1] for head in heads} - {""})
    ends = 4 + size + np.cumsum([0, *lengths])
    rows = {}
    for width, (begin, end) in zip(widths, itertools.pairwise(ends.tolist()), strict=True):
        part = data[begin:end]
        rows[width] = iter(np.frombuffer(blosc2.decompress2(part) if effort else part, width).reshape(-1, n))
    columns = {}
    for name, width, how, *rest in heads:
        residue = next(rows[width]) if width else None
        if how == "c":
            columns[name] = np.full(n, rest[0])
        elif how == "r":
            first, span, steps = rest
            columns[name] = first + np.arange(n) * span // steps
        elif how == "w":
            columns[name] = np.array(rest[0])
        else:
            assert residue is not None
            columns[name] = residue if how == "f" else residue.astype(np.int64) + rest[0]
    return columns


def joined(parts: list[dict[str, Array]]) -> dict[str, Array]:
    """Return the columns of blocks that follow each other."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def residuals_of(database: Path, serial: str, version: int, sets: Sets) -> dict[str, tuple[Array, Array]]:
    """Return for each axis the measured error and the residual, corrected rate less true rate, (n,) deg/s.

    The error model is output = rate + bias + (scale factor and misalignment) rate, which is solved for the rate.
    """
    with sqlite3.connect(database) as file:
        (document,) = file.execute(
            "select document from calibrations where serial = ? and version = ?", (serial, version)
        ).fetchone()
    stored = json.loads(document)
    away_k = sets.temperature_c - stored["model"]["reference"]["temperature_c"]
    axes = list(sets.output_dps)
    n = len(sets.number)
    bias, matrix = np.zeros((n, len(axes))), np.tile(np.eye(len(axes)), (n, 1, 1))
    for row, axis in enumerate(axes):
        for name, each in stored["coefficients"][axis].items():
            stem, power = name.rsplit("_t", 1) if name.rsplit("_t", 1)[-1].isdigit() else (name, "0")
            change = each["value"] * away_k ** int(power)
            if stem == "bias":
                bias[:, row] += change
            elif stem == "scale_factor":
                matrix[:, row, row] += change
            elif stem.startswith("misalignment_"):
                matrix[:, row, axes.index(stem[-1])] += change
            else:
                raise ValueError(f"{name}: a coefficient of a model that is not written here")
    output = np.column_stack([sets.output_dps[axis] for axis in axes])
    true = sets.rate_dps[:, ["xyz".index(axis) for axis in axes]]
    corrected = np.linalg.solve(matrix, (output - bias)[:, :, None])[:, :, 0]
    return {axis: (output[:, k] - true[:, k], corrected[:, k] - true[:, k]) for k, axis in enumerate(axes)}
