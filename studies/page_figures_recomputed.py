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

from studies.page_figures_formulas import Law

Array = np.ndarray
#: Rate of the Earth (WGS 84).
EARTH_DPS = float(np.degrees(7.292115e-5))

#: Columns of a campaign that are whole numbers of a part of a unit: name, and how many parts the unit has.
CLOCK = {"t_ns": ("t_s", 10**9), "chamber_mc": ("chamber_c", 1000)}


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
    position: Array  #: (n,)
    from_s: Array  #: (n,) time of the first reading; NaN for points
    until_s: Array  #: (n,)
    table_angle_deg: Array  #: (n,) at the beginning
    raw: dict[str, Array]  #: channel -> every valid reading in order of time; {} for points
    begins: Array  #: (n + 1,) place of the first of these of each data set

    @property
    def own_rate_dps(self) -> dict[str, Array]:
        """The rate of the unit about each axis with an output, (n,)."""
        return {axis: self.rate_dps[:, "xyz".index(axis)] for axis in self.output_dps}

    @property
    def earth_dps(self) -> float:
        """The Earth's rate along the axis of the table."""
        first = about(str(self.position[0]))
        return float(self.rate_dps[0] @ first - self.table_rate_dps[0])

    @property
    def t_s(self) -> Array | None:
        """The middle of each data set, (n,) s: of the time in which its readings were taken; None: without times."""
        return (self.from_s + self.until_s) / 2 if self.raw else self.mean.get("t_s")

    @property
    def table_angle_rad(self) -> Array:
        """Where the table was at the beginning of each data set, (n,)."""
        return np.radians(self.table_angle_deg)

    @property
    def turned_rad(self) -> Array:
        """How far the table went in each data set, (n,)."""
        return np.radians(self.table_rate_dps * (self.until_s - self.from_s))


def sets_of(database: Path, recording: int) -> Sets:
    """Return the complete data sets of a recording."""
    with sqlite3.connect(database) as file:
        info, channels = (json.loads(text) for text in file.execute(
            "select info, channels from recordings where id = ?", (recording,)
        ).fetchone())  # fmt: skip
        heads = file.execute(
            "select number, position, table_rate_dps, n, gate_from_s, gate_until_s, table_angle_deg from data_sets "
            "where recording_id = ? and state = 'complete' order by number", (recording,),
        ).fetchall()  # fmt: skip
        blocks = file.execute(
            "select number, n, data from sample_blocks where recording_id = ? order by number, seq", (recording,)
        ).fetchall()
    number, position, table_rate, readings, *rest = (np.array(column) for column in zip(*heads, strict=True))
    from_s, until_s, angle_deg = (each.astype(float) for each in rest)  # None becomes NaN
    earth_dps = 0.0 if info["latitude_deg"] is None else EARTH_DPS * np.sin(np.radians(info["latitude_deg"]))
    rate = np.array([about(up) * (dps + earth_dps) for up, dps in zip(position, table_rate, strict=True)])
    raw: dict[str, Array] = {}
    std: dict[str, Array] = {}
    begins = np.zeros(1, dtype=int)
    if info["kind"] == "points":
        columns = unpacked(*blocks[0][1:])
        mean = {name: np.asarray(values, dtype=float) for name, values in columns.items() if values.dtype.kind != "U"}
    else:
        by_set = [joined([unpacked(*block[1:]) for block in blocks if block[0] == n]) for n in number.tolist()]
        raw, begins = _valid(by_set, channels)
        parts = {name: np.split(values, begins[1:-1]) for name, values in raw.items()}
        mean = {name: np.array([np.mean(part) for part in each]) for name, each in parts.items()}
        std = {name: np.array([np.std(part, ddof=1) for part in each]) for name, each in parts.items()}
    output = {}
    for axis in info["axes"]:
        law = info["output"].get(axis, {})
        output[axis] = (mean[f"gyro_{axis}"] - law.get("offset", 0.0)) / law.get("scale", 1.0)
    return Sets(
        number, table_rate, rate, mean["temperature_c"], output, std, mean, readings, position, from_s, until_s,
        angle_deg, raw, begins,
    )  # fmt: skip


def _valid(by_set: list[dict[str, Array]], channels: list[dict[str, Any]]) -> tuple[dict[str, Array], Array]:
    """Return the valid readings of each column of numbers, in its own unit, and where each data set begins."""
    declared = {each["name"]: each for each in channels}
    whole = joined(by_set)
    rows = (
        np.asarray(whole["valid"], dtype=bool)
        if "valid" in whole
        else np.ones(len(next(iter(whole.values()))), dtype=bool)
    )
    raw = {}
    for name, values in whole.items():
        if values.dtype.kind not in "Ub":
            law = declared.get(name, {"offset": 0.0, "scale": 1.0})  # what was imported is stored in its unit
            own, parts = CLOCK.get(name, (name, 1))
            raw[own] = (law["offset"] + law["scale"] * np.asarray(values, dtype=float) / parts)[rows]
    ends = np.cumsum([len(next(iter(each.values()))) for each in by_set])
    return raw, np.concatenate([[0], np.cumsum(rows)[ends - 1]])


def clock_u_of(database: Path, recording: int) -> float:
    """Return the relative standard uncertainty of the clock that sets the rates, which it states in ppm; 0: none is."""
    clocks = [each for each in info_of(database, recording)["standards"] if each["quantity"] == "clock"]
    return sum(1e-6 * each["expanded"] / each["k"] for each in clocks)


def info_of(database: Path, recording: int) -> dict[str, Any]:
    """Return what a recording states of unit and bench."""
    with sqlite3.connect(database) as file:
        (info,) = file.execute("select info from recordings where id = ?", (recording,)).fetchone()
    return dict(json.loads(info))


def stability_of(database: Path, recording: int) -> float | None:
    """Return the bias stability of the data sheet as a standard deviation, deg/s; None: none is stated as one."""
    info = info_of(database, recording)
    stated = info["datasheet"].get("bias_stability_dps")
    assert stated is None or info["datasheet_conventions"]["bias_stability_dps"] == "1 sigma"
    return None if stated is None else float(stated)


def turning_size_of(database: Path, recording: int) -> float:
    """Return the size of the Earth's rate that goes round with the table, deg/s."""
    return float(EARTH_DPS * np.cos(np.radians(info_of(database, recording)["latitude_deg"])))


def environment_of(database: Path, recording: int) -> dict[str, Array]:
    """Return what was logged beside the readings, by column (n,), in order of time."""
    names = ("t_s", "temperature_c", "chamber_c", "chamber_setpoint_c")
    with sqlite3.connect(database) as file:
        rows = file.execute(
            f"select {', '.join(names)} from environment where recording_id = ? order by t_s", (recording,)
        ).fetchall()
    return {name: np.array(column, dtype=float) for name, column in zip(names, zip(*rows, strict=True), strict=True)}


def steps_of(database: Path, campaign: int) -> dict[str, Array]:
    """Return when the steps of a campaign began and ended, s of its clock, (n,) in order."""
    with sqlite3.connect(database) as file:
        rows = file.execute(
            "select started_s, ended_s from steps where campaign_id = ? order by number", (campaign,)
        ).fetchall()
    return {
        name: np.array(column, dtype=float)
        for name, column in zip(("started_s", "ended_s"), zip(*rows, strict=True), strict=True)
    }


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


def law_of(database: Path, serial: str, version: int) -> Law:
    """Return the law of a version, by its stored document."""
    with sqlite3.connect(database) as file:
        (document,) = file.execute(
            "select document from calibrations where serial = ? and version = ?", (serial, version)
        ).fetchone()
    return Law.of(json.loads(document))


def residuals_of(law: Law, sets: Sets) -> dict[str, tuple[Array, Array]]:
    """Return for each axis the measured error and the residual, corrected rate less true rate, (n,) deg/s."""
    output = np.column_stack([sets.output_dps[axis] for axis in law.axes])
    true = np.column_stack([sets.own_rate_dps[axis] for axis in law.axes])
    corrected = law.corrected(output, sets.temperature_c)
    return {axis: (output[:, k] - true[:, k], corrected[:, k] - true[:, k]) for k, axis in enumerate(law.axes)}
