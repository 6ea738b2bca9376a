"""All checks of readings, in order, what one finding explains of another, and what a picture of them shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from labctl.json_types.inspection import CourseJson, MarkJson
from labctl.recording.recording import Recording
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.changes import check_noise, check_sampling
from labctl.recording.sanity.readings.clock import check_clock, check_gaps
from labctl.recording.sanity.readings.constant import check_frozen, check_repeated
from labctl.recording.sanity.readings.courses import courses_of, joined_courses, marks_of
from labctl.recording.sanity.readings.limits import check_clipped, check_steps
from labctl.recording.sanity.readings.lines import check_lines
from labctl.recording.sanity.readings.mixture import check_copies, check_devices, check_units
from labctl.recording.sanity.readings.series import Marked, Rows, Series, series_of
from labctl.recording.sanity.readings.sudden import check_moved, check_spikes
from labctl.recording.sanity.readings.thermometers import check_thermometers

#: What a finding explains of others: of any rows, or of rows that it covers.
EXPLAINS = {
    "mixed_units": frozenset(
        {"two_devices", "level_step", "moved", "mains", "vibration", "clipped", "spikes", "noise_changes"}
    ),
    "two_devices": frozenset({"moved", "mains", "vibration", "clipped", "spikes", "copied", "repeated"}),
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
    of_values = [replace(each, rows=_spread(each.rows, at, n)) for each in _of_values(series)]
    return [*check_clock(whole), *check_gaps(whole), *check_sampling(whole), *of_values]


def _rows(recording: Recording, kept: Rows) -> Recording:
    return replace(recording, columns={name: np.asarray(values)[kept] for name, values in recording.columns.items()})


def _spread(rows: Rows, at: np.ndarray[tuple[int], np.dtype[np.int64]], n: int) -> Rows:
    found = np.zeros(n, dtype=bool)
    found[at[rows]] = True
    return found


def examination(recording: Recording) -> Examination:
    """Return what is wrong with the readings of a recording, and the course of its channels."""
    found = examine(recording)
    return Examination([each.finding for each in found], courses_of(recording), marks_of(recording, found))


def joined_examinations(parts: Sequence[Examination]) -> Examination:
    """Return the examinations of parts of a recording, in order, as one; equal findings are one, with the n of all."""
    findings: dict[tuple[str, str], Finding] = {}
    for finding in (finding for part in parts for finding in part.findings):
        key = finding.what, finding.channel
        known = findings.get(key)
        more = None if known is None else (known.n or 0) + (finding.n or 0)
        findings[key] = finding if known is None else replace(known, n=more)
    marks = [mark for part in parts for mark in part.marks]
    return Examination(list(findings.values()), joined_courses([part.courses for part in parts]), marks)


def _of_values(series: Series) -> list[Marked]:
    frozen = list(check_frozen(series))
    repeated = list(check_repeated(series, _all(frozen, len(series))))
    clipped = list(check_clipped(series, _all(repeated, len(series))))
    found = [
        *frozen, *repeated, *clipped, *check_thermometers(series),
        *check_steps(series),
        *check_units(series), *check_devices(series), *check_copies(series), *check_spikes(series),
        *check_moved(series), *check_noise(series), *check_lines(series),
    ]  # fmt: skip
    return [each for each in found if not _is_explained(each, found)]


def _all(found: list[Marked], n: int) -> Rows:
    return np.any([each.rows for each in found], axis=0) if found else np.zeros(n, dtype=bool)


def _is_explained(one: Marked, found: list[Marked]) -> bool:
    for other in found:
        if one.finding.what not in EXPLAINS.get(other.finding.what, frozenset()):
            continue
        if other.finding.what not in OF_CHANNEL or other.finding.channel == one.finding.channel:
            return True
    return False
