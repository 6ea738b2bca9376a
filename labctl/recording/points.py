"""From readings to data sets: mean, standard deviation and number of the valid readings of each (Ojeda eqs. 5, 6)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from labctl.recording.motions.turn_means import turned_points
from labctl.recording.motions.windows import kept_windows, usual_step_s, white_std_of_profile, window_labels
from labctl.recording.quantisation import steps_columns
from labctl.recording.recording import Columns, Recording, temperature_of
from labctl.recording.spread import MIN_FOR_SPECTRUM, white_stds

if TYPE_CHECKING:
    from labctl.answers.recording_head import Motion

#: Columns that one data set has one value of: its first reading's.
FIRST = (
    "dataset", "position", "run", "mounting", "verification", "table_angle_deg", "recording", "recording_dataset",
)  # fmt: skip
#: A data set longer than this, through which the temperature moves by more than that, is no one point: it is taken in
#: pieces of about a minute, as long as the data sets of the published schedules.
LONG_S = 600.0
MOVED_K = 1.0
PIECE_S = 60.0
#: At rest a data set may be a whole ramp: in no window may the temperature move by more than this share of its range,
#: and no window has fewer readings. `_SLOPES` parts of a data set are compared for how fast the temperature moves.
WINDOW_SHARE, WINDOW_READINGS = 0.05, 16
_SLOPES = 20


def dataset_starts(dataset: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the row, (m,), at which each data set of (n,) rows begins."""
    return np.flatnonzero(np.concatenate([[True], dataset[1:] != dataset[:-1]]))


def pieces(columns: Columns, motion: Motion = "rates") -> NDArray[np.int64]:
    """Return labels (n,) of readings: they rise with the data set, and within one that is taken in pieces."""
    dataset, temperatures_c = np.asarray(columns["dataset"], dtype=np.int64), temperature_of(columns)
    piece = np.zeros(len(dataset), dtype=np.int64)
    if len(dataset) and "t_s" in columns and (temperatures_c is not None or motion == "rest"):
        t_s = np.asarray(columns["t_s"], dtype=np.float64)
        starts = dataset_starts(dataset)
        is_turn = np.asarray(columns["turn_deg"]) != 0 if "turn_deg" in columns else np.zeros(len(dataset), dtype=bool)
        for begin, end in zip(starts, np.append(starts[1:], len(dataset)), strict=True):
            if is_turn[begin]:  # a part of a turn is no known angle
                continue
            since_s, warm_rows = (
                t_s[begin:end] - t_s[begin],
                None if temperatures_c is None else temperatures_c[begin:end],
            )
            if motion == "rest":
                piece[begin:end] = _windows(since_s, warm_rows)
            elif warm_rows is not None:
                piece[begin:end] = _minutes(since_s, warm_rows)
    changes = (dataset[1:] != dataset[:-1]) | (piece[1:] != piece[:-1])
    return np.concatenate([[0], np.cumsum(changes)]).astype(np.int64)


def _minutes(since_s: NDArray[np.float64], temperature_c: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the piece of each reading of a data set, (n,); all 0 where it stays whole."""
    length_s = float(since_s[-1])
    whole = np.zeros(len(since_s), dtype=np.int64)
    if not length_s > LONG_S:
        return whole
    parts = round(length_s / PIECE_S)
    piece = np.minimum(since_s / length_s * parts, parts - 1).astype(np.int64)
    readings = np.bincount(piece)
    # of means, so that neither the thermometer's noise nor a stray reading counts as a move
    means = np.bincount(piece, weights=temperature_c)[readings > 0] / readings[readings > 0]
    return piece if np.ptp(means) > MOVED_K else whole


def _windows(since_s: NDArray[np.float64], temperature_c: NDArray[np.float64] | None) -> NDArray[np.int64]:
    """Return the window of each reading of a data set at rest, (n,): about a minute, less where the unit warms faster.

    A window is short against the change of the temperature, so that its mean stands for one point of any smooth law of
    temperature and time, and has readings enough for its white noise to be known.
    """
    length_s, n = float(since_s[-1]), len(since_s)
    parts = round(length_s / PIECE_S)
    if temperature_c is not None and n >= _SLOPES * WINDOW_READINGS:
        means = np.array([part.mean() for part in np.array_split(temperature_c, _SLOPES)])
        if np.ptp(means) > MOVED_K:
            fastest = float(np.abs(np.diff(means)).max()) / float(np.ptp(means))
            parts = max(parts, int(np.ceil(_SLOPES * fastest / WINDOW_SHARE)))
    parts = max(min(parts, n // WINDOW_READINGS), 1)
    return np.minimum(since_s / max(length_s, 1e-9) * parts, parts - 1).astype(np.int64)


def longest_undivided_s(motion: Motion) -> float:
    """Return up to which duration, s, a data set has one row of means, whatever its readings are."""
    return 0.0 if motion == "rest" else LONG_S


def with_pieces(points: Recording, pieces_of: Callable[[int], Recording]) -> Recording:
    """Return points with a row for each piece of a data set that is divided, under the number of the data set.

    For means that are kept without their readings: `pieces_of` returns `to_points` of the readings of a data set; only
    the long ones are asked for. A column that the readings do not have, such as the set point, is copied from the set.
    """
    columns = {name: np.asarray(values) for name, values in points.columns.items()}
    longest_s = longest_undivided_s(points.info.motion)
    if not np.any(np.asarray(columns.get("duration_s", 0.0), dtype=np.float64) > longest_s):
        return points
    rows: list[dict[str, NDArray[np.generic]]] = []
    for row in range(len(points)):
        kept = {name: values[row : row + 1] for name, values in columns.items()}
        if kept["duration_s"][0] > longest_s:
            pieces = pieces_of(int(kept["dataset"][0]))
            if len(pieces) > 1:
                kept = {n: pieces.columns[n] if n in pieces.columns else v.repeat(len(pieces)) for n, v in kept.items()}
        rows.append(kept)
    joined = {name: np.concatenate([kept[name] for kept in rows]) for name in columns} if rows else columns
    return Recording(points.info, joined, points.environment)


def to_points(recording: Recording) -> Recording:
    """Return the recording with one row per data set (kind "points"); points and coefficients return as they are.

    A long data set through which the temperature moved, and at rest any that is longer than a window, has a row for
    each of its pieces, under its own number; where the rate changes (motion "profile") there is a row for each window
    (`in_windows`). Only valid readings count. `t_s` is the middle of the data set, `table_angle_deg` its start,
    `duration_s` its length; each gyro column gains `_std` (n - 1), where every set has readings enough `_white_std`,
    and where its readings come in coarse steps `_quantisation_std`; every row gains `n`. A data set without a valid
    reading is left out.
    """
    if recording.info.kind != "samples":
        return recording
    columns = recording.columns
    valid = np.asarray(columns["valid"]) != 0 if "valid" in columns else np.ones(len(recording), dtype=bool)
    rows = {name: np.asarray(values)[valid] for name, values in columns.items() if name != "valid"}
    if recording.info.motion == "profile":
        return in_windows(recording, rows)
    starts = dataset_starts(pieces(rows, recording.info.motion))
    counts = np.diff(np.append(starts, len(rows["dataset"])))
    points: dict[str, NDArray[np.generic]] = {}
    for name, values in rows.items():
        if name in FIRST or values.dtype.kind not in "fiu":
            points[name] = values[starts]
        elif name == "t_s":
            t_s = np.asarray(values, dtype=np.float64)
            ends = t_s[starts + counts - 1]
            points[name] = (t_s[starts] + ends) / 2
            points["duration_s"] = (ends - t_s[starts]) * counts / np.maximum(counts - 1, 1)
        else:
            points[name], spread = _mean_and_std(values.astype(np.float64), starts, counts)
            if name.startswith("gyro_"):
                points[f"{name}_std"] = spread
                sets = np.split(values.astype(np.float64), starts[1:])
                points |= steps_columns(name, sets)
                if counts.min() >= MIN_FOR_SPECTRUM:
                    points[f"{name}_white_std"] = white_stds(sets)
    points["n"] = counts.astype(np.int64)
    if recording.info.motion == "turns":
        points |= turned_points(rows, points, starts, counts)
    return Recording(recording.info.model_copy(update={"kind": "points"}), points, recording.environment)


def in_windows(recording: Recording, rows: Columns) -> Recording:
    """Return a recording whose rate changes, of valid readings `rows`, as one row per kept window (kind "points").

    Each column is a mean over the window, of which `t_s` is the middle and `duration_s` the length. Readings scatter
    within a window because the rate changes, so there is no `_std`: `_white_std` is the noise beside that.
    """
    labels = window_labels(rows)
    starts = dataset_starts(labels)
    counts = np.diff(np.append(starts, len(rows["dataset"])))
    points: dict[str, NDArray[np.generic]] = {}
    for name, values in rows.items():
        if name in FIRST or values.dtype.kind not in "fiu":
            points[name] = values[starts]
        else:
            points[name] = np.add.reduceat(values.astype(np.float64), starts) / counts
    for axis in recording.info.axes:
        white = white_std_of_profile(rows, np.asarray(rows[f"gyro_{axis}"], dtype=np.float64))
        if white is not None:
            points[f"gyro_{axis}_white_std"] = white[starts]
    points["duration_s"] = counts * usual_step_s(rows)
    points["n"] = counts.astype(np.int64)
    kept = kept_windows(rows, labels)
    points = {name: values[kept] for name, values in points.items()}
    return Recording(recording.info.model_copy(update={"kind": "points"}), points, recording.environment)


def _mean_and_std(
    values: NDArray[np.float64], starts: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    means = np.add.reduceat(values, starts) / counts
    squares = np.add.reduceat((values - np.repeat(means, counts)) ** 2, starts)
    return means, np.sqrt(squares / np.maximum(counts - 1, 1))
