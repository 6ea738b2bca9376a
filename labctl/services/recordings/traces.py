"""A channel over time, in as many bins as a picture has columns, however many readings there are."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recordings import TraceResponse
from labctl.errors import BadInput
from labctl.recording import RecordingInfo
from labctl.recording.columns import BY_NAME
from labctl.services.recordings.envelopes import Array, Envelope, bins_of, courses_of, envelope_of
from labctl.store import DataSetRow, Store

#: More readings than this are not read for one picture; their envelope is drawn.
MAX_RAW = 2_000_000


def trace(
    store: Store, recording: int, channel: str, from_s: float | None, until_s: float | None, points: int
) -> TraceResponse:
    """Return a channel in at most `points` bins; without a window over the whole recording.

    Raises NotFound, and BadInput for a channel that is not there, a window that is none, or means without times.
    """
    head = store.recordings.get(recording)
    info = head.recording_info
    rows = [row for row in store.recordings.data_sets(recording) if row.state == "complete" and row.n]
    if head.kind == "samples":
        courses = courses_of(store.recordings.dataset(recording, rows[0].number)) if rows else []
        begins, ends = [row.t_from_s for row in rows], [row.t_until_s for row in rows]
    else:
        table = dict(store.recordings.points(recording).columns)
        if "t_s" not in table:
            raise BadInput(
                f"recording {recording} holds {head.kind} without times (no column t_s), so no channel can be "
                "shown over time; show its data sets instead"
            )
        courses = courses_of(table)
        begins = ends = np.asarray(table["t_s"], dtype=np.float64).tolist()
    if courses and channel not in courses:
        raise BadInput(f"recording {recording} has no channel {channel!r}; choose one of {', '.join(sorted(courses))}")
    low, high = _window(from_s, until_s, [t for t in begins if t is not None], [t for t in ends if t is not None])
    raw = True
    if head.kind != "samples":
        trace_points = _as_it_is(table["t_s"], table[channel])
    else:
        inside = [row for row in rows if _overlaps(row, low, high)]
        raw = _is_few(inside, low, high, points)
        trace_points = _readings(store, recording, channel, inside) if raw else envelope_of(store, recording, channel)
    binned = _binned(trace_points, low, high, points)
    return TraceResponse(
        recording=recording, channel=channel, unit=unit_of(info, channel), from_s=low, until_s=high, raw=raw,
        t_s=binned.t_s.tolist(), min=binned.low.tolist(), max=binned.high.tolist(), mean=binned.mean.tolist(),
        n=binned.n.astype(np.int64).tolist(), channels=sorted(courses),
    )  # fmt: skip


def unit_of(info: RecordingInfo, channel: str) -> str:
    """Return the unit of a channel of a recording; empty: it has none."""
    for axis in info.axes:
        if channel.startswith(f"gyro_{axis}"):
            output = info.output.get(axis)
            return output.unit if output is not None else "deg/s"
    column = BY_NAME.get(channel)
    return column.unit if column is not None else ""


def _window(
    from_s: float | None, until_s: float | None, begins: list[float], ends: list[float]
) -> tuple[float | None, float | None]:
    for name, value in (("from_s", from_s), ("until_s", until_s)):
        if value is not None and not math.isfinite(value):
            raise BadInput(f"{name} = {value} s: give a finite number")
    low = from_s if from_s is not None else min(begins, default=None)
    high = until_s if until_s is not None else max(ends, default=None)
    if low is not None and high is not None and (low > high or (low == high and from_s is not None)):
        raise BadInput(f"from_s = {low:g} s is not before until_s = {high:g} s; give a start that is before the end")
    return low, high


def _overlaps(row: DataSetRow, low: float | None, high: float | None) -> bool:
    if row.t_from_s is None or row.t_until_s is None:
        return True
    return (high is None or row.t_from_s <= high) and (low is None or row.t_until_s >= low)


def _is_few(inside: list[DataSetRow], low: float | None, high: float | None, points: int) -> bool:
    """Whether the envelopes would be coarser than the picture, and the readings are few enough to be read instead."""
    bins = 0.0
    for row in inside:
        share = 1.0
        if low is not None and high is not None and row.t_from_s is not None and row.t_until_s is not None:
            lasted = max(row.t_until_s - row.t_from_s, 1e-9)
            share = min(max((min(high, row.t_until_s) - max(low, row.t_from_s)) / lasted, 0.0), 1.0)
        bins += share * bins_of(row.n)
    return bins < points and sum(row.n for row in inside) <= MAX_RAW


def _readings(store: Store, recording: int, channel: str, rows: list[DataSetRow]) -> Envelope:
    times, values = [np.zeros(0)], [np.zeros(0)]
    for row in rows:
        columns = store.recordings.dataset(recording, row.number)
        if channel in columns:
            times.append(np.asarray(columns["t_s"], dtype=np.float64))
            values.append(np.asarray(columns[channel], dtype=np.float64))
    return _as_it_is(np.concatenate(times), np.concatenate(values))


def _as_it_is(t_s: NDArray[np.generic], values: NDArray[np.generic]) -> Envelope:
    """Return an envelope whose bins are single readings."""
    numbers = np.asarray(values, dtype=np.float64)
    is_finite = np.isfinite(numbers)
    numbers, times = numbers[is_finite], np.asarray(t_s, dtype=np.float64)[is_finite]
    return Envelope(times, numbers, numbers, numbers, np.ones(len(numbers)))


def _binned(envelope: Envelope, low: float | None, high: float | None, points: int) -> Envelope:
    """Return what lies in a window in at most `points` bins of equal time, without the empty ones."""
    if low is None or high is None:
        return Envelope(*(np.zeros(0) for _ in range(5)))
    inside = np.flatnonzero((envelope.t_s >= low) & (envelope.t_s <= high) & (envelope.n > 0))
    if len(inside) == 0:
        return Envelope(*(np.zeros(0) for _ in range(5)))
    share = (envelope.t_s[inside] - low) / (high - low) if high > low else np.zeros(len(inside))
    which = np.minimum((share * points).astype(np.int64), points - 1)
    order = np.argsort(which, kind="stable")
    rows, which = inside[order], which[order]
    begins = np.flatnonzero(np.concatenate([[True], which[1:] != which[:-1]]))
    n: Array = np.add.reduceat(envelope.n[rows], begins)
    return Envelope(
        np.add.reduceat(envelope.t_s[rows] * envelope.n[rows], begins) / n,
        np.minimum.reduceat(envelope.low[rows], begins),
        np.maximum.reduceat(envelope.high[rows], begins),
        np.add.reduceat(envelope.mean[rows] * envelope.n[rows], begins) / n,
        n,
    )
