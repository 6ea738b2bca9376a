"""The course of each channel for a picture: all readings in bins, and the places of what was found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from labctl.json_types.inspection import CourseJson, MarkJson
from labctl.recording.columns import BY_NAME
from labctl.recording.points import dataset_starts
from labctl.recording.recording import Recording
from labctl.recording.sanity.readings.series import Array, Marked, measured_names, runs

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


def marks_of(recording: Recording, found: Sequence[Marked]) -> list[MarkJson]:
    """Return where each finding is, by time."""
    t_s = np.asarray(recording.columns["t_s"], dtype=np.float64) if found else np.zeros(0)
    return [_mark(each, t_s) for each in found]


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
        known = joined.get(course["channel"])
        if known is None:
            joined[course["channel"]] = course
            continue
        joined[course["channel"]] = {
            "channel": course["channel"], "unit": course["unit"], "t_s": [*known["t_s"], None, *course["t_s"]],
            "low": [*known["low"], None, *course["low"]], "high": [*known["high"], None, *course["high"]],
            "readings": known["readings"] + course["readings"], "bins": known["bins"] + course["bins"],
        }  # fmt: skip
    return list(joined.values())
