"""Time stamps of single readings: rows out of order, a clock that was set, readings that are missing."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

import numpy as np

from labctl.recording.sanity.finding import Finding, numbers_in_words
from labctl.recording.sanity.readings.series import ROBUST, Array, Marked, Rows, Series, rows_in_words

#: Rows before and after a step of the clock whose time stamps show whether it lasts.
BESIDE = 25
#: A clock was set back where it stays back by so many usual steps.
SET_STEPS = 1.5
#: Readings closer than this share of the usual step were taken twice over: by a clock that was set back.
CLOSE = 0.5
#: Readings whose usual step says whether one is wide; the steps of a log may change.
STEPS = 51
#: Readings are missing where a step of time is so many usual ones, and so many usual deviations from them.
GAP_STEPS, GAP_DEVIATIONS = 2.5, 12.0
#: One reading is missing where a step is two usual ones within this share of one, and so many usual deviations longer
#: than one, while the steps beside it are whole: a reading that only came late is followed by a short step.
NEAR_STEP, WHOLE_STEP = 0.2, 0.8
#: Fewer single readings are missing from no mean that one could tell.
MIN_SINGLE = 3
#: More rows out of order than this share are no accident, and are not left out.
MAX_OUT_OF_ORDER_SHARE = 0.02


def rows_in_order(t_s: Array) -> Rows:
    """Return which of (n,) rows to keep, (n,), so that the time rises from each to the next and the most are kept."""
    ends: list[float] = []  # the least last time of a rising sequence of each length
    last: list[int] = []
    before = np.full(len(t_s), -1)
    for row, value in enumerate(t_s.tolist()):
        length = bisect_right(ends, value)
        if length and ends[length - 1] == value:
            continue  # the same time again
        before[row] = last[length - 1] if length else -1
        if length == len(ends):
            ends.append(value)
            last.append(row)
        else:
            ends[length], last[length] = value, row
    in_order = np.zeros(len(t_s), dtype=bool)
    row = last[-1] if last else -1
    while row >= 0:
        in_order[row] = True
        row = int(before[row])
    return in_order


def check_clock(series: Series) -> Iterator[Marked]:
    """Yield rows that are out of order, and places where the clock was set back."""
    steps = np.diff(series.t_s)
    falls = np.flatnonzero(steps <= 0) + 1
    if not len(falls):
        return
    lasting = (
        []
        if _is_shuffled(series)
        else [(int(row), shift) for row in falls if (shift := _shift_s(series, int(row))) < -SET_STEPS * series.step_s]
    )
    if lasting:
        yield from _set_back(series, lasting)
        return
    out = ~rows_in_order(series.t_s)
    n = int(out.sum())
    worst = int(np.argmin(steps)) + 1
    do = "row does" if n == 1 else "rows do"
    few = n <= MAX_OUT_OF_ORDER_SHARE * len(series)
    yield Marked(
        Finding(
            "time_back", "certain", f"t_s, {rows_in_words(out)}",
            f"{n} {do} not follow the row before in time, row {worst + 1} by {steps[worst - 1]:.4g} s",
            float(steps[worst - 1]), "s", "time stamps that rise from row to row",
            "leave these rows out, or sort the rows in the order of measurement" if few else
            "sort the rows in the order of measurement, or divide the recording",
            channel="t_s", n=n, may_leave_out=few,
        ),
        out,
    )  # fmt: skip


def _is_shuffled(series: Series) -> bool:
    """Whether the rows, sorted by time, are as even as a clock that was never set back: only their order is wrong."""
    steps = np.diff(np.sort(series.t_s))
    return bool(np.all(steps > CLOSE * series.step_s))


def _shift_s(series: Series, row: int) -> float:
    """Return by how much the clock stays ahead of even time from a row on, s."""
    part = next(part for part in series.parts if part.start <= row < part.stop)
    if row == part.start:
        return 0.0
    begin, end = max(row - BESIDE, part.start), min(row + BESIDE, part.stop)
    off = series.t_s[begin:end] - series.step_s * np.arange(begin, end)
    return float(np.median(off[row - begin :]) - np.median(off[: row - begin]))


def _set_back(series: Series, lasting: list[tuple[int, float]]) -> Iterator[Marked]:
    row, shift = min(lasting, key=lambda each: each[1])
    rows = np.zeros(len(series), dtype=bool)
    rows[[each for each, _ in lasting]] = True
    yield Marked(
        Finding(
            "clock_step", "certain", f"t_s, {rows_in_words(rows)}",
            f"the clock was set back by {-shift:.4g} s at row {row + 1}, while the readings go on",
            shift, "s", "a clock that is not set while it measures",
            f"add {-shift:.6g} s to the time stamps from row {row + 1} on, or divide the recording there",
            channel="t_s", n=len(lasting),
        ),
        rows,
    )  # fmt: skip


def check_gaps(series: Series) -> Iterator[Marked]:
    """Yield the data sets in which readings are missing, or the clock was set on."""
    steps = np.diff(np.sort(series.t_s))  # rows out of order leave no gap
    same = series.dataset[1:] == series.dataset[:-1]
    usual = _usual_steps(np.diff(series.t_s), series.step_s)
    spread = ROBUST * float(np.median(np.abs(steps[same] - usual[same]))) if same.any() else 0.0
    wide = same & (steps > np.maximum(GAP_STEPS * usual, usual + GAP_DEVIATIONS * spread))
    single = same & _is_one_missing(steps / usual, spread / usual)
    if single.sum() >= MIN_SINGLE:
        wide |= single
    if not wide.any():
        return
    rows = np.concatenate([[False], wide])
    lacking = np.unique(series.dataset[rows])
    lost = np.maximum(np.round(steps[wide] / usual[wide]) - 1, 1)
    longest = int(np.argmax(np.where(wide, steps, 0.0)))
    yield Marked(
        Finding(
            "gaps", "likely", f"{numbers_in_words(lacking)} ({len(lacking)} of {len(series.parts)})",
            f"readings are missing in {int(wide.sum())} places, the longest gap is {steps[longest]:.3g} s at row "
            f"{longest + 2}; or the clock was set on there",
            float(steps[longest]), "s", f"a reading every {usual[longest]:.3g} s",
            "check the logger and its clock; lost readings are missing from the mean", channel="t_s",
            n=int(lost.sum()),
        ),
        rows,
    )  # fmt: skip


def _is_one_missing(ratio: Array, spread: Array) -> Rows:
    """Return where one reading is missing, (n,), from steps of time and their spread over the usual step."""
    beside = np.pad(ratio, 1, constant_values=1.0)
    whole = np.minimum(beside[:-2], beside[2:]) > WHOLE_STEP
    return np.asarray((np.abs(ratio - 2.0) < NEAR_STEP) & (ratio > 1.0 + GAP_DEVIATIONS * spread) & whole)


def _usual_steps(steps: Array, usual: float) -> Array:
    """Return the usual step around each of (n,) steps of time; `usual` where they are too few to tell."""
    blocks = len(steps) // STEPS
    if blocks < 3:
        return np.full(len(steps), usual)
    of_blocks = np.pad(np.median(steps[: blocks * STEPS].reshape(blocks, STEPS), axis=1), 1, mode="edge")
    around = np.median([of_blocks[:-2], of_blocks[1:-1], of_blocks[2:]], axis=0)
    step_s = around[np.minimum(np.arange(len(steps)) // STEPS, blocks - 1)]
    return np.asarray(np.where(step_s > 0, step_s, usual))  # stamps that several readings share say nothing
