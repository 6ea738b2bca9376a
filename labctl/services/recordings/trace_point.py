"""A bin of a trace, or the mean of a data set: the readings that it is made of, and the same computed again."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.answers.points import FigurePointResponse
from labctl.answers.recordings import TraceResponse
from labctl.errors import BadInput, NotFound
from labctl.services.cache import UNNAMED, compute
from labctl.services.recordings.envelopes import bins_of
from labctl.services.recordings.figure_point import figure_number, figure_point
from labctl.services.recordings.traces import trace, unit_of
from labctl.store import DataSetRow, Store

#: Rounding of a kept envelope, which has single precision, as a share of the largest reading.
SINGLE = float(np.finfo(np.float32).eps)
#: Rounding of a mean of readings, as a share of the largest of them.
DOUBLE = 1e-12
#: Time by which a bin that was asked for may differ from one of the figure, s.
SAME_TIME_S = 1e-6
Array = NDArray[np.float64]


@dataclass(frozen=True)
class TraceWindow:
    """Which trace: channel, window in s since the recording began (None: to its end), largest number of bins."""

    channel: str
    from_s: float | None = None
    until_s: float | None = None
    points: int = 2000


def trace_point(store: Store, recording: int, window: TraceWindow, t_s: float) -> FigurePointResponse:
    """Return the bin of a trace at its time, s, and least, largest and mean of its readings as they are now.

    Raises NotFound for a time at which the trace has no bin, and what `trace` raises.
    """
    shown = trace(store, recording, window.channel, window.from_s, window.until_s, window.points)
    k = int(np.argmin(np.abs(np.asarray(shown.t_s) - t_s))) if shown.t_s else -1
    if k < 0 or not abs(shown.t_s[k] - t_s) <= SAME_TIME_S:
        raise NotFound(
            f"the trace of {window.channel} in recording {recording} has no bin at {t_s:g} s; choose one of its points"
        )
    compute(UNNAMED)
    by_dataset = {} if _without_readings(store, recording) else _readings_of_bin(store, shown, window.points, k)
    values = np.concatenate(list(by_dataset.values())) if by_dataset else np.zeros(0)
    sets = sorted(by_dataset) or [0, 0]
    rounding = (DOUBLE if shown.raw else SINGLE) * float(np.max(np.abs(values), initial=1e-300))
    again = (
        (float(values.mean()), float(values.min()), float(values.max()), float(len(values)))
        if len(values)
        else (None,) * 4
    )
    unit = shown.unit
    drawn = (shown.mean[k], shown.min[k], shown.max[k], float(shown.n[k]))
    names = ("mean", "smallest reading", "largest reading", "readings")
    numbers = [
        figure_number(
            name, unit if name != "readings" else "", value, now, rounding=rounding if name != names[3] else 0
        )
        for name, value, now in zip(names, drawn, again, strict=True)
    ]
    title = f"{window.channel} at {shown.t_s[k]:.6f} s"
    formula = mean_formula(values, unit)
    return figure_point("trace", title, recording, (sets[0], sets[-1]), numbers, formula, values)


def mean_point(store: Store, recording: int, dataset: int, channel: str) -> FigurePointResponse:
    """Return the kept mean of a channel in a data set, and mean and standard deviation of its readings as they are now.

    Raises NotFound, BadInput for a channel without a mean.
    """
    head = store.recordings.get(recording)
    kept = {row.channel: row for row in store.recordings.means(recording) if row.number == dataset}
    if not kept:
        raise NotFound(f"recording {recording} has no means of data set {dataset}; choose one of its data sets")
    if channel not in kept or kept[channel].mean is None:
        raise BadInput(
            f"data set {dataset} of recording {recording} has no mean of {channel!r}; choose one of "
            f"{', '.join(sorted(kept))}"
        )
    compute(UNNAMED)
    values = np.zeros(0)
    if head.kind == "samples":
        columns = store.recordings.dataset(recording, dataset)
        values = np.asarray(columns[channel], dtype=np.float64)
        if "valid" in columns:
            values = values[np.asarray(columns["valid"]) != 0]
    unit, row = unit_of(head.recording_info, channel), kept[channel]
    rounding = DOUBLE * float(np.max(np.abs(values), initial=1.0))
    n = len(values)
    numbers = [figure_number("mean", unit, row.mean or 0.0, float(values.mean()) if n else None, rounding=rounding)]
    if row.std is not None:
        again = float(values.std(ddof=1)) if n > 1 else None
        numbers.append(figure_number("standard deviation of the readings", unit, row.std, again, rounding=rounding))
    title = f"{channel}, mean of data set {dataset}"
    return figure_point("mean", title, recording, (dataset, dataset), numbers, mean_formula(values, unit), values)


def mean_formula(values: Array, unit: str) -> str:
    """Return the mean of readings (n,) with its numbers; empty without readings."""
    if not len(values):
        return ""
    total = math.fsum(values.tolist())
    return f"mean = sum / number = {total:.9g} / {len(values)} = {total / len(values):.9g} {unit}".rstrip()


def _without_readings(store: Store, recording: int) -> bool:
    return store.recordings.get(recording).kind != "samples"


def _readings_of_bin(store: Store, shown: TraceResponse, points: int, k: int) -> dict[int, Array]:
    """Return the readings of the k-th bin, (n,) in the channel's unit, by data set: read now."""
    low, high = shown.from_s or 0.0, shown.until_s or 0.0
    width = (high - low) / points
    b = _bin_of(np.array([shown.t_s[k]]), low, high, points)[0]
    rows = [row for row in store.recordings.data_sets(shown.recording) if row.state == "complete" and row.n]
    by_dataset = {}
    for row in rows:
        if not _reaches(row, low + b * width, low + (b + 1) * width):
            continue
        columns = store.recordings.dataset(shown.recording, row.number)
        if shown.channel not in columns:
            continue
        t_s, values = (np.asarray(columns[name], dtype=np.float64) for name in ("t_s", shown.channel))
        if not shown.raw:  # readings belong to the bin in which the middle of their part of the envelope lies
            edges = np.linspace(0, len(t_s), bins_of(len(t_s)) + 1).astype(np.int64)
            size = np.diff(edges)
            t_s = np.repeat(np.add.reduceat(t_s, edges[:-1]) / size, size)
        inside = (t_s >= low) & (t_s <= high) & np.isfinite(values)
        inside &= _bin_of(t_s, low, high, points) == b
        if inside.any():
            by_dataset[row.number] = values[inside]
    return by_dataset


def _bin_of(t_s: Array, low: float, high: float, points: int) -> NDArray[np.int64]:
    share = (t_s - low) / (high - low) if high > low else np.zeros(len(t_s))
    return np.minimum((share * points).astype(np.int64), points - 1)


def _reaches(row: DataSetRow, low: float, high: float) -> bool:
    if row.t_from_s is None or row.t_until_s is None:
        return True
    return row.t_from_s <= high and row.t_until_s >= low
