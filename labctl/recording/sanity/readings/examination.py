"""All checks of readings, in order, what one finding explains of another, and what a picture of them shows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labctl.json_types.inspection import CourseJson, MarkJson
from labctl.recording.recording import Recording
from labctl.recording.sanity.finding import Finding
from labctl.recording.sanity.readings.changes import check_noise, check_sampling
from labctl.recording.sanity.readings.clock import check_clock, check_gaps
from labctl.recording.sanity.readings.constant import check_frozen, check_repeated
from labctl.recording.sanity.readings.courses import courses_of, joined_courses, marks_of
from labctl.recording.sanity.readings.exchanged import check_exchanged
from labctl.recording.sanity.readings.factors import check_factors
from labctl.recording.sanity.readings.limits import check_clipped, check_steps
from labctl.recording.sanity.readings.lines import check_lines
from labctl.recording.sanity.readings.mixture import check_copies, check_devices, check_units
from labctl.recording.sanity.readings.series import Marked, Rows, Series, series_of
from labctl.recording.sanity.readings.shifted import check_shifted
from labctl.recording.sanity.readings.sudden import check_moved, check_spikes
from labctl.recording.sanity.readings.thermometers import check_thermometers

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
    of_values = [replace(each, rows=_spread(each.rows, at, n)) for each in _of_values(recording, series, at)]
    return [*check_clock(whole), *check_gaps(whole), *check_sampling(whole), *of_values]


def _rows(recording: Recording, kept: Rows | Indices) -> Recording:
    return replace(recording, columns={name: np.asarray(values)[kept] for name, values in recording.columns.items()})


def _spread(rows: Rows, at: Indices, n: int) -> Rows:
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


def _of_values(recording: Recording, series: Series, at: Indices) -> list[Marked]:
    """Return what is wrong with the valid readings, n of a recording at rows (n,)."""
    n = len(series)
    frozen = list(check_frozen(series))
    repeated = list(check_repeated(series, _all(frozen, n)))
    clipped = list(check_clipped(series, _all(repeated, n)))
    shifted = list(check_shifted(series))
    found = [*frozen, *repeated, *clipped, *check_thermometers(series), *shifted]
    # what is written again is no reading, and makes the noise look smaller; a shifted row is none of its outputs
    once = np.flatnonzero(~_all([*repeated, *shifted], n))
    alone = series if len(once) == n else series_of(_rows(recording, at[once]))
    if alone is not None:
        found += [replace(each, rows=_spread(each.rows, once, n)) for each in _of_each(alone)]
    return [each for each in found if not _is_explained(each, found)]


def _of_each(series: Series) -> Iterator[Marked]:
    """Yield what is wrong with readings of which each is one of its own."""
    for check in (
        check_steps, check_exchanged, check_factors, check_units, check_devices, check_copies, check_spikes,
        check_moved, check_noise, check_lines,
    ):  # fmt: skip
        yield from check(series)


def _all(found: list[Marked], n: int) -> Rows:
    return np.any([each.rows for each in found], axis=0) if found else np.zeros(n, dtype=bool)


def _is_explained(one: Marked, found: list[Marked]) -> bool:
    for other in found:
        if one.finding.what not in EXPLAINS.get(other.finding.what, frozenset()):
            continue
        if other.finding.what not in OF_CHANNEL or other.finding.channel == one.finding.channel:
            return True
    return False
