"""Turns by a known angle: one turn in each data set, with its uncertainty, as a mean rate over the data set.

Nothing but the mean of the rate is known, so what is not linear in the rate cannot be found from turns.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from labctl.errors import BadRecording
from labctl.recording.info import RecordingInfo
from labctl.recording.motions.turn_means import LEAST
from labctl.recording.points import dataset_starts
from labctl.recording.recording import Columns

#: Standard uncertainty of a turn, deg, where a recording has no turn_u_deg: a hand that stops at an edge or a line.
USUAL_U_DEG = 1.0


def check_turns(path: Path, info: RecordingInfo, columns: Columns) -> None:
    """Raise BadRecording where a data set has no single turn, no length, or no possible uncertainty."""
    turn = np.asarray(columns["turn_deg"], dtype=np.float64)
    u_deg = np.asarray(columns["turn_u_deg"], dtype=np.float64) if "turn_u_deg" in columns else np.zeros(len(turn))
    wrong = ~(u_deg >= 0)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise BadRecording(
            f"{path}: column 'turn_u_deg', row {row + 1}: {u_deg[row]:g} deg; give an uncertainty of at least 0 deg"
        )
    if info.kind == "points":
        _check_means(path, info, columns)
        return
    starts, ends, number = _data_sets(columns)
    for name, values in (("turn_deg", turn), ("turn_u_deg", u_deg)):
        first = np.repeat(values[starts], ends - starts)
        if (values != first).any():
            row = int(np.argmax(values != first))
            raise BadRecording(
                f"{path}: column {name!r}, row {row + 1}: {values[row]:g} deg in data set {number[row]}, which began "
                f"with {first[row]:g} deg; a data set is one turn: give the readings of each turn a separate data "
                "set number"
            )
    valid = _valid(columns)
    counts = np.add.reduceat(valid.astype(np.int64), starts)
    short = (counts < LEAST) & (turn[starts] != 0)
    if short.any():
        row = int(starts[np.argmax(short)])
        raise BadRecording(
            f"{path}: column 'turn_deg', row {row + 1}: data set {number[row]} has {int(counts[short][0])} valid "
            f"readings; the integral over a turn needs at least {LEAST}: leave the data set out, or turn again"
        )


def _check_means(path: Path, info: RecordingInfo, columns: Columns) -> None:
    """Refuse means without duration, spread or number of readings, which weight rests and turns."""
    for name in ("n", *(f"gyro_{axis}_std" for axis in info.axes)):
        if name not in columns:
            raise BadRecording(
                f"{path}: column {name!r} is missing; the weights of rests and turns are computed from it: add the "
                "column, or give the readings (kind = 'samples')"
            )
    duration_s = np.asarray(columns["duration_s"], dtype=np.float64)
    wrong = ~(duration_s > 0)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise BadRecording(
            f"{path}: column 'duration_s', row {row + 1}: {duration_s[row]:g} s; give the time over which the mean "
            "was taken, more than 0 s"
        )


def mean_rate_dps(info: RecordingInfo, columns: Columns) -> NDArray[np.float64]:
    """Return the mean rate of each row's data set about its position's axis, (n,) deg/s: the turn over its time."""
    turn = np.asarray(columns["turn_deg"], dtype=np.float64)
    if info.kind == "points":
        return np.asarray(turn / np.asarray(columns["duration_s"], dtype=np.float64))
    starts, ends, _ = _data_sets(columns)
    t_s, valid = np.asarray(columns["t_s"], dtype=np.float64), _valid(columns)
    rates_dps = np.zeros(len(turn))
    for begin, end in zip(starts, ends, strict=True):
        times_s = t_s[begin:end][valid[begin:end]]
        if len(times_s) >= LEAST:
            rates_dps[begin:end] = turn[begin:end] / (times_s[-1] - times_s[0])
    return rates_dps


def _data_sets(columns: Columns) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    number = np.asarray(columns["dataset"], dtype=np.int64)
    starts = dataset_starts(number)
    return starts, np.append(starts[1:], len(number)).astype(np.int64), number


def _valid(columns: Columns) -> NDArray[np.bool_]:
    n = len(columns["dataset"])
    return np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(n, dtype=bool)
