"""All checks of readings, in order, what one finding explains of another, and what a picture of them shows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.answers.inspection import CourseJson, MarkJson
from labctl.recording.columns import BY_NAME
from labctl.recording.points import dataset_starts
from labctl.recording.recording import Recording
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.changes import check_noise, check_sampling
from labctl.recording.sanity.readings.constant import check_frozen, check_repeated
from labctl.recording.sanity.readings.exchanged import check_exchanged
from labctl.recording.sanity.readings.factors import check_factors
from labctl.recording.sanity.readings.mixture import check_copies, check_devices, check_units
from labctl.recording.sanity.readings.series import (
    Array,
    Marked,
    Rows,
    Series,
    measured_names,
    rows_in_words,
    runs,
    series_of,
    spread_of,
)
from labctl.recording.sanity.readings.shifted import check_shifted
from labctl.recording.sanity.readings.spectral_lines import check_lines
from labctl.recording.sanity.readings.sudden import check_moved, check_spikes
from labctl.recording.sanity.readings.thermometers import check_thermometers
from labctl.recording.sanity.readings.time_stamps import check_clock, check_gaps

#: Bins of a course, at most; readings below twice as many are drawn one by one.
BINS = 600
#: Places of one finding that are drawn, at most: the longest.
PLACES = 60


def courses_of(recording: Recording) -> list[CourseJson]:
    """Return the course of each measured channel of readings; nothing for means and tables."""
    if recording.info.kind != "samples" or "t_s" not in recording.columns or not len(recording):
        return []
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64)
    begins, breaks = _bins(np.asarray(recording.columns["dataset"], dtype=np.int64))
    channels = [(f"gyro_{axis}", recording.gyro_dps(axis), "deg/s") for axis in recording.info.axes]
    channels += [
        (name, np.asarray(recording.columns[name], dtype=np.float64), BY_NAME[name].unit)
        for name in measured_names(recording.columns)
    ]
    return [_course(name, unit, t_s, values, begins, breaks) for name, values, unit in channels]


def _bins(dataset: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the first row of each bin, (k,), and before which of them a data set ends, (k,)."""
    n = len(dataset)
    starts = dataset_starts(dataset)
    even = np.arange(n) if n <= 2 * BINS else np.linspace(0, n, BINS + 1).astype(np.int64)[:-1]
    begins = np.union1d(even, starts) if len(starts) <= BINS else even
    breaks = np.isin(begins, starts[1:])
    return begins, breaks


def _course(
    name: str, unit: str, t_s: Array, values: Array, begins: NDArray[np.int64], breaks: NDArray[np.bool_]
) -> CourseJson:
    low, high = np.fmin.reduceat(values, begins), np.fmax.reduceat(values, begins)
    at = np.flatnonzero(breaks)
    times, lows, highs = (np.insert(each.astype(np.float64), at, np.nan) for each in (t_s[begins], low, high))
    return {
        "channel": name, "unit": unit, "t_s": _numbers(times), "low": _numbers(lows), "high": _numbers(highs),
        "readings": int(np.isfinite(values).sum()), "bins": len(begins),
    }  # fmt: skip


def _numbers(values: Array) -> list[float | None]:
    return [float(value) if np.isfinite(value) else None for value in values.tolist()]


def marks_of(recording: Recording, marked: Sequence[Marked]) -> list[MarkJson]:
    """Return where each finding is, by time."""
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64) if marked else np.zeros(0)
    return [_mark(each, t_s) for each in marked]


def _mark(marked: Marked, t_s: Array) -> MarkJson:
    whole = bool(marked.rows.all())
    places = [] if whole else list(runs(marked.rows))
    longest = sorted(sorted(places, key=lambda place: place[0] - place[1])[:PLACES])
    channel = marked.finding.channel
    return {
        "what": marked.finding.what, "channel": "" if channel == "t_s" else channel,
        "from_s": [float(t_s[max(begin - 1, 0)]) for begin, _ in longest],
        "until_s": [float(t_s[min(end, len(t_s) - 1)]) for _, end in longest],
        "places": len(places), "whole": whole,
    }  # fmt: skip


def joined_courses(parts: Sequence[list[CourseJson]]) -> list[CourseJson]:
    """Return the courses of parts of a recording as one for each channel."""
    joined: dict[str, CourseJson] = {}
    for course in (course for part in parts for course in part):
        joined_course = joined.get(course["channel"])
        if joined_course is None:
            joined[course["channel"]] = course
            continue
        joined[course["channel"]] = {
            "channel": course["channel"], "unit": course["unit"], "t_s": [*joined_course["t_s"], None, *course["t_s"]],
            "low": [*joined_course["low"], None, *course["low"]],
            "high": [*joined_course["high"], None, *course["high"]],
            "readings": joined_course["readings"] + course["readings"], "bins": joined_course["bins"] + course["bins"],
        }  # fmt: skip
    return list(joined.values())


#: An output is coarse whose step is above so many times the noise that its readings have, steps included.
COARSE_STEP = 1.9
#: Readings at the end of a range, at least: of an output in fine steps, of any other.
MIN_IN_STEPS, MIN_EQUAL = 30, 8
#: An output is clipped where so many readings are expected beyond its last code, or the last code has this many times
#: the readings of the code before. Steps above this many noises leave no shape that could tell.
BEYOND, PILE, COARSE = 20.0, 2.5, 1.2


def check_steps(series: Series) -> Iterator[Marked]:
    """Yield the outputs whose steps are larger than their noise."""
    for name, values in series.outputs.items():
        step, spread = series.code_steps[name], spread_of(values)
        if not step or step < COARSE_STEP * spread:
            continue
        yield Marked(
            Finding(
                "quantised", "likely", name,
                f"the output changes in steps of {step:.4g} deg/s, and its readings differ by {spread:.2g} deg/s from "
                "one to the next",
                step, "deg/s", "a step below twice the noise", "log the output with more digits or a finer converter",
                channel=name, n=len(series),
            ),
            np.ones(len(series), dtype=bool),
        )  # fmt: skip


def check_clipped(series: Series, repeated: Rows) -> Iterator[Marked]:
    """Yield the outputs that pile up at an end of their range."""
    for name, values in series.outputs.items():
        step, noise = series.code_steps[name], series.noises[name]
        ends = []
        for sign in (1.0, -1.0):
            signed = sign * values
            top = float(signed.max())
            at_end = signed >= top - 0.25 * step if step else signed == top
            if _is_pile(signed[~repeated], at_end[~repeated], top, step, noise):
                ends.append((sign * top, at_end))
        if not ends:
            continue
        rows = np.any([at_end for _, at_end in ends], axis=0)
        limits_text = " and ".join(f"{top:.5g}" for top, _ in ends)
        yield Marked(
            Finding(
                "clipped", "likely", f"{name}, {rows_in_words(rows)}",
                f"{int(rows.sum())} readings are exactly at {limits_text} deg/s, and none beyond",
                ends[0][0], "deg/s", "readings that thin out towards the ends of their range",
                "leave out the data sets or readings at the limit, or measure at lower rates or in a larger range: "
                "means of clipped readings are too small",
                channel=name, n=int(rows.sum()), may_leave_out=True,
            ),
            rows,
        )  # fmt: skip


def _is_pile(values: Array, at_end: Rows, top: float, step: float, noise: float) -> bool:
    n_end = int(at_end.sum())
    if n_end == len(values) or (noise == 0 and step):
        return False
    if not step:
        return n_end >= MIN_EQUAL
    if n_end < MIN_IN_STEPS or step > COARSE * noise:
        return False
    width = step * max(round(0.5 * noise / step), 1)  # codes that are much finer than the noise hold too few readings
    below = top - 0.5 * step - width * np.arange(3)
    before = int(np.sum((values < below[0]) & (values >= below[1])))
    second = int(np.sum((values < below[1]) & (values >= below[2])))
    ratio = n_end / max(before, 1)
    return ratio > PILE or n_end * ratio * min(ratio / max(before / max(second, 1), 1e-9), 1.0) > BEYOND


Indices = NDArray[np.int64]
#: What a finding explains of others: of any rows, or of rows that it covers.
EXPLAINS = {
    "mixed_units": frozenset(
        {"two_devices", "level_step", "moved", "mains", "vibration", "clipped", "spikes", "noise_changes"}
    ),
    "shifted": frozenset(
        {"thermometer", "frozen", "moved", "noise_changes", "two_devices", "level_step", "spikes", "clipped"}
    ),
    "axes_swapped": frozenset(
        {"gain_changes", "sign", "level_step", "moved", "noise_changes", "two_devices", "mixed_units"}
    ),
    "gain_changes": frozenset({"level_step", "moved", "mains", "vibration", "clipped", "noise_changes", "two_devices"}),
    "sign": frozenset({"level_step", "moved", "two_devices"}),
    "two_devices": frozenset({"moved", "mains", "vibration", "clipped", "spikes", "copied"}),
    "level_step": frozenset({"moved"}),
    "quantised": frozenset({"mains", "vibration", "clipped", "repeated"}),
    "moved": frozenset({"mains", "vibration"}),
    "repeated": frozenset({"mains", "vibration", "noise_changes"}),
    "thermometer": frozenset({"spikes"}),
    "frozen": frozenset({"moved", "quantised", "noise_changes", "level_step", "clipped"}),
    "clipped": frozenset({"noise_changes"}),
}
#: Findings that explain others of their own channel only.
OF_CHANNEL = frozenset({"thermometer", "frozen", "level_step", "clipped"})


@dataclass(frozen=True)
class Examination:
    """What is wrong with single readings, and what a picture of it shows."""

    findings: list[Finding]
    courses: list[CourseJson]
    marks: list[MarkJson]


def examine(recording: Recording) -> list[Marked]:
    """Return what is wrong with single readings, with the rows of each; nothing for means and tables.

    Of rows that are marked as bad only the time is examined: they are no gap.
    """
    n = len(recording)
    valid = np.asarray(recording.columns["valid"]) != 0 if "valid" in recording.columns else np.ones(n, dtype=bool)
    whole = series_of(recording)
    series = whole if valid.all() else series_of(_rows(recording, valid))
    if whole is None or series is None or not all(np.isfinite(values).all() for values in series.outputs.values()):
        return []
    at = np.flatnonzero(valid)
    of_values = [replace(fault, rows=_spread(fault.rows, at, n)) for fault in _of_values(recording, series, at)]
    return [*check_clock(whole), *check_gaps(whole), *check_sampling(whole), *of_values]


def _rows(recording: Recording, rows: Rows | Indices) -> Recording:
    return replace(recording, columns={name: np.asarray(values)[rows] for name, values in recording.columns.items()})


def _spread(rows: Rows, at: Indices, n: int) -> Rows:
    is_apart = np.zeros(n, dtype=bool)
    is_apart[at[rows]] = True
    return is_apart


def examination(recording: Recording) -> Examination:
    """Return what is wrong with the readings of a recording, and the course of its channels."""
    faults = examine(recording)
    return Examination([fault.finding for fault in faults], courses_of(recording), marks_of(recording, faults))


def joined_examinations(parts: Sequence[Examination]) -> Examination:
    """Return the examinations of parts of a recording, in order, as one; equal findings are one, with the n of all."""
    findings: dict[tuple[str, str], Finding] = {}
    for finding in (finding for part in parts for finding in part.findings):
        key = finding.what, finding.channel
        joined_finding = findings.get(key)
        more = None if joined_finding is None else (joined_finding.n or 0) + (finding.n or 0)
        findings[key] = finding if joined_finding is None else replace(joined_finding, n=more)
    marks = [mark for part in parts for mark in part.marks]
    return Examination(list(findings.values()), joined_courses([part.courses for part in parts]), marks)


def _of_values(recording: Recording, series: Series, at: Indices) -> list[Marked]:
    """Return what is wrong with the valid readings, n of a recording at rows (n,)."""
    n = len(series)
    frozen = list(check_frozen(series))
    repeated = list(check_repeated(series, _all(frozen, n)))
    clipped = list(check_clipped(series, _all(repeated, n)))
    shifted = list(check_shifted(series))
    faults = [*frozen, *repeated, *clipped, *check_thermometers(series), *shifted]
    # what is written again is no reading, and makes the noise look smaller; a shifted row is none of its outputs
    once = np.flatnonzero(~_all([*repeated, *shifted], n))
    alone = series if len(once) == n else series_of(_rows(recording, at[once]))
    if alone is not None:
        faults += [replace(each, rows=_spread(each.rows, once, n)) for each in _of_each(alone)]
    return [fault for fault in faults if not _is_explained(fault, faults)]


def _of_each(series: Series) -> Iterator[Marked]:
    """Yield what is wrong with readings of which each is one of its own."""
    for check in (
        check_steps, check_exchanged, check_factors, check_units, check_devices, check_copies, check_spikes,
        check_moved, check_noise, check_lines,
    ):  # fmt: skip
        yield from check(series)


def _all(marked: list[Marked], n: int) -> Rows:
    return np.any([each.rows for each in marked], axis=0) if marked else np.zeros(n, dtype=bool)


def _is_explained(fault: Marked, marked: list[Marked]) -> bool:
    for other in marked:
        if fault.finding.what not in EXPLAINS.get(other.finding.what, frozenset()):
            continue
        if other.finding.what not in OF_CHANNEL or other.finding.channel == fault.finding.channel:
            return True
    return False
