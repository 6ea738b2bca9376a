"""The readings of a recording as plain series, and what the checks of readings have in common."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labctl.recording.points import dataset_starts
from labctl.recording.recording import Recording
from labctl.recording.sanity.finding import Finding

Array = NDArray[np.float64]
Rows = NDArray[np.bool_]
ROBUST = 1.4826
#: Steps between codes that are this close, as a share of the largest value, are rounding.
SAME_CODE = 1e-9
#: Readings that show the steps between the codes of a channel.
CODE_READINGS = 20_000
#: Readings on either side of a row that show level and noise, at least and at most, and those next to it left out.
MIN_NEIGHBOURS, MAX_NEIGHBOURS, GUARD = 12, 120, 3
#: Rows with the largest changes of each kind that are examined in a data set.
CANDIDATES = 3


@dataclass(frozen=True)
class Series:
    """n readings in the order of their rows.

    `outputs` are the gyro's, in deg/s, and `thermometers` temperatures, in deg C, by the name of their column; `others`
    are further measured columns, such as an accelerometer's. `rate_dps` is the table's, (n,), None where it is not
    known; `still` says of each row whether the unit is said to rest, (n,).
    """

    t_s: Array
    dataset: NDArray[np.int64]
    rate_dps: Array | None
    still: Rows
    outputs: Mapping[str, Array]
    thermometers: Mapping[str, Array]
    others: Mapping[str, Array]
    motion: str

    def __len__(self) -> int:
        return len(self.t_s)

    @cached_property
    def parts(self) -> list[slice]:
        """The rows of each data set."""
        starts = dataset_starts(self.dataset)
        ends = np.append(starts[1:], len(self.dataset))
        return [slice(int(begin), int(end)) for begin, end in zip(starts, ends, strict=True)]

    @cached_property
    def step_s(self) -> float:
        """Usual time between readings of a data set."""
        same = self.dataset[1:] == self.dataset[:-1]
        steps = np.diff(self.t_s)[same]
        steps = steps[steps > 0]
        return float(np.median(steps)) if len(steps) else 1.0

    @cached_property
    def residuals(self) -> Mapping[str, Array]:
        """Each output less what follows the table's rate, where that is known, (n,) deg/s."""
        return {name: _less_rate(values, self.rate_dps, self.motion) for name, values in self.outputs.items()}

    @cached_property
    def noises(self) -> Mapping[str, float]:
        """Standard deviation of one reading of each output, deg/s."""
        return {
            name: noise_of(values, self.dataset, moving=not self.code_steps[name])
            for name, values in self.outputs.items()
        }

    @cached_property
    def code_steps(self) -> Mapping[str, float]:
        """Smallest step between two codes of each output, deg/s; 0 where hardly a value comes twice."""
        return {name: code_step(values) for name, values in self.outputs.items()}

    @cached_property
    def largest_changes(self) -> Mapping[str, list[list[int]]]:
        """Of each output, and each of `parts`: the rows of the part at which its level or noise changes most."""
        return {name: [largest_changes(values[part]) for part in self.parts] for name, values in self.outputs.items()}


@dataclass(frozen=True)
class Marked:
    """A finding with the rows that it is about, (n,); with more than one channel, of any."""

    finding: Finding
    rows: Rows


def series_of(recording: Recording) -> Series | None:
    """Return the readings of a recording that are not marked as bad; None for means and tables."""
    columns, info = recording.columns, recording.info
    if info.kind != "samples" or "t_s" not in columns or len(recording) < 2:
        return None
    numbers = {name: np.asarray(columns[name], dtype=np.float64) for name in measured_names(columns)}
    n = len(recording)
    kinds = {"rates", "profile", "rest"}
    rate = None
    if info.motion == "rest":
        rate = np.zeros(n)
    elif info.motion in kinds and "table_rate_dps" in columns:
        rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
    if info.motion == "turns" and "turn_deg" in columns:
        still = np.asarray(columns["turn_deg"], dtype=np.float64) == 0
    else:
        still = np.zeros(n, dtype=bool) if rate is None else rate == 0
    if info.motion == "profile":
        still = np.zeros(n, dtype=bool)  # between two rates the unit is said to stand for an instant only
    at_rest = info.motion == "rates" and rate is not None and not rate.any()  # a rest, written as rates of 0
    return Series(
        np.asarray(columns["t_s"], dtype=np.float64), np.asarray(columns["dataset"], dtype=np.int64), rate, still,
        {f"gyro_{axis}": recording.gyro_dps(axis) for axis in info.axes},
        {name: values for name, values in numbers.items() if name.endswith("_c")},
        {name: values for name, values in numbers.items() if not name.endswith("_c")},
        "rest" if at_rest else info.motion,
    )  # fmt: skip


def measured_names(columns: Mapping[str, NDArray[np.generic]]) -> list[str]:
    """Return the columns that hold what sensors beside the gyro measured."""
    names = {"temperature_c", "own_temperature_c", "reference_c", "chamber_c", "supply_v"}
    names |= {f"temperature_{axis}_c" for axis in "xyz"} | {f"accel_{axis}_g" for axis in "xyz"}
    return [name for name in columns if name in names]


def _less_rate(values: Array, rate: Array | None, motion: str) -> Array:
    centred = values - float(np.median(values))
    if rate is None or not np.ptp(rate):
        return centred
    late = [np.gradient(rate)] if motion == "profile" else []  # an output is late by some readings
    columns = np.column_stack([np.ones(len(rate)), rate, *late])
    solution = np.linalg.lstsq(columns, centred, rcond=None)[0]
    return np.asarray(centred - columns @ solution)


def noise_of(values: Array, dataset: NDArray[np.int64] | None = None, *, moving: bool = False) -> float:
    """Return the standard deviation of one reading of (n,) by third differences: smooth motion does not count.

    With `moving` readings that stay at a value do not count either.
    """
    third = np.diff(values, 3)
    if dataset is not None:
        third = third[dataset[3:] == dataset[:-3]]
    size = np.abs(third[third != 0] if moving else third)
    if not len(size):
        return 0.0
    robust = ROBUST * float(np.median(size))
    if robust == 0 and np.any(size > 0):  # more than half of the readings repeat the one before: the others tell
        robust = ROBUST * float(np.median(size[size > 0]))
    return robust / np.sqrt(20.0)


def spread_of(values: Array) -> float:
    """Return the root mean square of third differences of (n,) as the noise of one reading, steps of a code included.

    The largest percent of them does not count, nor do readings that stay.
    """
    size = np.sort(np.abs(np.diff(values, 3)))
    return float(np.sqrt(np.mean(size[: max(int(0.99 * len(size)), 1)] ** 2) / 20.0))


def code_step(values: Array) -> float:
    """Return the smallest step between two codes of readings (n,); 0 where hardly a value comes twice."""
    some = values[:: max(len(values) // CODE_READINGS, 1)]
    codes = np.unique(some)
    if len(codes) < 2 or len(codes) > 0.9 * len(some):
        return 0.0
    apart = np.diff(codes)
    apart = apart[apart > SAME_CODE * float(np.abs(codes).max())]
    return float(apart.min()) if len(apart) else 0.0


def largest_changes(values: Array) -> list[int]:
    """Return the rows at which the level, or the noise, of (n,) readings changes most; none of too few readings."""
    n = len(values)
    if n < 2 * (MIN_NEIGHBOURS + GUARD):
        return []
    beside = int(np.clip(n // 8, MIN_NEIGHBOURS, MAX_NEIGHBOURS // 2))
    at = np.arange(MIN_NEIGHBOURS, n - MIN_NEIGHBOURS + 1)
    low, high = np.maximum(at - beside, 0), np.minimum(at + beside, n)
    third = np.abs(np.diff(values, 3))
    jerk = np.log(np.maximum(np.concatenate([third[:1], third, third[-2:]]), 1e-12 + float(np.median(third)) / 100.0))
    rows: list[int] = []
    for course in (np.clip(values, *np.percentile(values, [0.5, 99.5])), jerk):
        total = np.concatenate([[0.0], np.cumsum(course - course.mean())])
        step = np.abs((total[high] - total[at]) / (high - at) - (total[at] - total[low]) / (at - low))
        for _ in range(CANDIDATES):
            best = int(np.argmax(step))
            rows.append(int(at[best]))
            step[max(best - beside, 0) : best + beside] = 0.0
    return list(dict.fromkeys(rows))


def gain_of(values: Array, rate: Array | None) -> float:
    """Return by how much an output (n,) changes per deg/s of the table; 0 where the table's rate does not change."""
    if rate is None or not np.ptp(rate):
        return 0.0
    centred = rate - rate.mean()
    return float(centred @ (values - values.mean()) / (centred @ centred))


def runs(is_same: Rows) -> Iterator[tuple[int, int]]:
    """Yield the stretches of rows that hold, as (first row, row after the last)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], is_same.astype(np.int8), [0]])))
    for begin, end in edges.reshape(-1, 2):
        yield int(begin), int(end)


def medians_of_five(values: Array) -> Array:
    """Return the median of each of (n,) values and the two on either side; the ends are repeated."""
    padded = np.pad(values, 2, mode="edge")
    a, b, c, d, e = (padded[k : k + len(values)] for k in range(5))
    low_ab, high_ab, low_de, high_de = np.minimum(a, b), np.maximum(a, b), np.minimum(d, e), np.maximum(d, e)
    low, high = np.maximum(low_ab, low_de), np.minimum(high_ab, high_de)  # neither the least nor the largest of four
    return np.asarray(np.maximum(np.minimum(low, high), np.minimum(np.maximum(low, high), c)))


def medians_around(values: Array, readings: int) -> Array:
    """Return the median of the `readings` (odd) values around each of (n,); the ends are repeated."""
    half = readings // 2
    padded = np.pad(values, half, mode="edge")
    medians = np.empty(len(values))
    for begin in range(0, len(values), 50_000):  # a window of every row at once would take too much memory
        end = min(begin + 50_000, len(values))
        window = np.lib.stride_tricks.sliding_window_view(padded[begin : end + 2 * half], readings)
        medians[begin:end] = np.median(window, axis=1)
    return medians


def rows_in_words(rows: Rows) -> str:
    """Return "row 7" or "rows 7 to 20 and 3 more places"; rows count from 1."""
    row_runs = list(runs(rows))
    if not row_runs:
        return "no row"
    begin, end = row_runs[0]
    first = f"row {begin + 1}" if end == begin + 1 else f"rows {begin + 1} to {end}"
    more = len(row_runs) - 1
    return first + (f" and {more} more place{'s' if more > 1 else ''}" if more else "")
