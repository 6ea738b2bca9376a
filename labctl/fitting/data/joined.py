"""Several recordings of one unit as one: columns one below the other, and the column `recording` with their numbers.

What counts up in each recording (data sets, runs, mountings) goes on counting, so that nothing of two recordings has
one number; `t_s` runs from the start of the first, and `recording_t_s` is the time within each. A recording whose date
of measurement is not known has no place in that order: it comes behind the dated ones, and no time between recordings
may then be taken from `t_s` (`trend_t_s`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from labctl.answers.recording_head import Motion
from labctl.errors import BadInput
from labctl.fitting.data.covered import Covered
from labctl.fitting.data.temperature.channel import with_temperature
from labctl.recording import Recording, RecordingInfo, Standard, to_points
from labctl.recording.columns import OWN_DATASET, RECORDING, WITHIN_S
from labctl.recording.info import NO_DATE
from labctl.recording.verification import fitted_part

#: Numbers that go on counting from recording to recording.
COUNTED = ("dataset", "run", "mounting")
#: Recordings whose clocks overlap, as simulated ones do, are put this far behind one another, s.
APART_S = 3600.0
#: What must be the same in all of them: the document of a calibration says it once, or a fit takes it from the head.
SAME = ("serial", "axes", "output", "latitude_deg", "tilt_deg", "tilt_azimuth_deg", "table_axis")
#: Motions whose recordings have a rate of the table at each data set, and so go together.
WITH_TABLE_RATE: frozenset[Motion] = frozenset({"rates", "rest"})

Rows = dict[str, NDArray[np.generic]]


@dataclass
class _Counts:
    """How far the recordings joined so far have counted."""

    last: dict[str, int]
    end_s: float = 0.0


def joined_recording(parts: Mapping[int, Recording]) -> Recording:
    """Return recordings, number -> recording, as one, in order of their starts; a single one as it is.

    Those without a date of measurement follow by their numbers, and the head of the whole then has no date either.

    Readings stay readings where all of them have readings, else they become means. A channel that one of them lacks is
    left out, and so is what was measured to verify a calibration.

    Raises BadInput for recordings that do not go together, NotEnoughData where one has no thermometer.
    """
    if len(parts) == 1:
        return next(iter(parts.values()))
    order = sorted(parts, key=lambda number: _place(number, parts[number].info))
    _require_alike(order, parts)
    whole = {number: with_temperature(fitted_part(parts[number])) for number in order}
    if any(recording.info.kind != "samples" for recording in whole.values()):
        whole = {number: to_points(recording) for number, recording in whole.items()}
    first = whole[order[0]].info
    counts = _Counts(dict.fromkeys(COUNTED, 0))
    tables: list[Rows] = []
    surroundings: list[Rows] = []
    for number in order:
        rows, environment = _renumbered(number, whole[number], first, counts)
        tables.append(rows)
        surroundings.append(environment)
    info = first.model_copy(
        update={
            "max_rate_dps": max((r.info.max_rate_dps or 0.0) for r in whole.values()) or None,
            "date_known": all(recording.info.measured_at is not None for recording in whole.values()),
            "standards": _least_known([whole[number].info for number in order]),
        }
    )
    around = _below_one_another(surroundings) if all(surroundings) else None
    return Recording(info, _below_one_another(tables), around)


def _place(number: int, info: RecordingInfo) -> tuple[bool, datetime, int]:
    """Return where a recording comes: the time of an import orders nothing."""
    measured = info.measured_at
    return measured is None, measured or NO_DATE, number


def trend_t_s(info: RecordingInfo, columns: Mapping[str, NDArray[np.generic]]) -> NDArray[np.float64]:
    """Return the times, (n,) s, along which a trend may be looked for.

    Through all recordings where each has a date, else within each of them.
    """
    name = WITHIN_S if WITHIN_S in columns and info.measured_at is None else "t_s"
    return np.asarray(columns[name], dtype=np.float64)


def recordings_in(columns: Mapping[str, NDArray[np.generic]]) -> list[int]:
    """Return the numbers of the recordings that rows are of, in the order in which they were made; [] of a single one.

    The order is that of time, because it is the order of their rows; those without a date come last.
    """
    if RECORDING not in columns:
        return []
    numbers, first = np.unique(np.asarray(columns[RECORDING]), return_index=True)
    return [int(numbers[k]) for k in np.argsort(first)]


def joined_coverage(parts: Sequence[Covered | None]) -> Covered | None:
    """Return what several recordings cover together; None where that is not known of one of them."""
    known_parts = [part for part in parts if part is not None]
    if len(known_parts) < len(parts):
        return None
    axes = known_parts[0].rate_dps
    low, high = (
        [end for end in ends if end is not None] for ends in zip(*(p.temperature_c for p in known_parts), strict=True)
    )
    is_known = len(low) == len(high) == len(known_parts)  # a recording at rest may be without a thermometer
    return Covered(
        (min(low), max(high)) if is_known else (None, None),
        {
            a: (min(part.rate_dps[a][0] for part in known_parts), max(part.rate_dps[a][1] for part in known_parts))
            for a in axes
        },
    )


def _least_known(infos: Sequence[RecordingInfo]) -> tuple[Standard, ...]:
    """Return the standards of several recordings; of one that several have, the entry with the largest uncertainty.

    Campaigns of one bench share the errors of its standards, so that more campaigns do not reduce this uncertainty.
    """
    least_known: dict[tuple[str, str], Standard] = {}
    for each in (standard for info in infos for standard in info.standards):
        current = least_known.get((each.quantity, each.name))
        if current is None or current.standard_u <= each.standard_u:
            least_known[each.quantity, each.name] = each
    return tuple(least_known.values())


def _require_alike(order: Sequence[int], parts: Mapping[int, Recording]) -> None:
    first = parts[order[0]].info
    for number in order:
        info = parts[number].info
        if info.kind == "coefficients":
            raise BadInput(
                f"recording {number} of {info.serial} is a table of coefficients, but only recordings of "
                "readings or means can be fitted together; leave the recording out"
            )
        for name in SAME:
            if getattr(info, name) != getattr(first, name):
                raise BadInput(
                    f"recordings {order[0]} and {number} differ in {name} ({getattr(first, name)} and "
                    f"{getattr(info, name)}); fit the recordings one by one"
                )
        if info.motion != first.motion and not {info.motion, first.motion} <= WITH_TABLE_RATE:
            raise BadInput(
                f"recordings {order[0]} and {number} differ in motion ({first.motion} and {info.motion}); only "
                f"{' and '.join(sorted(WITH_TABLE_RATE))} can be fitted together; fit the recordings one by one"
            )


def _renumbered(number: int, recording: Recording, first: RecordingInfo, counts: _Counts) -> tuple[Rows, Rows]:
    """Return the columns and the environment of a recording as they stand in the joined one."""
    n = len(recording)
    columns: Rows = {name: np.asarray(values) for name, values in recording.columns.items()}
    columns[OWN_DATASET] = columns["dataset"] = np.asarray(columns["dataset"], dtype=np.int64)
    columns[RECORDING] = np.full(n, number, dtype=np.int64)
    columns.setdefault("position", np.full(n, recording.info.axes[0]))
    if recording.info.kind == "points" and "previous_rate_dps" not in columns:
        rate = np.asarray(columns["table_rate_dps"], dtype=np.float64)
        columns["previous_rate_dps"] = np.concatenate([[0.0], rate[:-1]])[:n]
    behind = dict(counts.last)
    for name in COUNTED:
        numbers = np.asarray(columns.get(name, np.ones(n)), dtype=np.int64)
        columns[name] = numbers - int(numbers.min(initial=1)) + 1 + behind[name]
        counts.last[name] = int(columns[name].max(initial=behind[name]))
    environment = _environment(recording, columns)
    shift_s = 0.0
    if "t_s" in columns:
        t_s = np.asarray(columns["t_s"], dtype=np.float64)
        dated = recording.info.measured_at is not None
        shift_s = (recording.info.started_at - first.started_at).total_seconds() if dated else 0.0
        if counts.end_s and shift_s + t_s.min(initial=np.inf) < counts.end_s:
            shift_s = counts.end_s + APART_S - float(t_s.min())
        columns |= {"t_s": t_s + shift_s, WITHIN_S: t_s}
        counts.end_s = float(t_s.max(initial=0.0)) + shift_s
    if "t_s" in environment:
        environment["t_s"] = np.asarray(environment["t_s"], dtype=np.float64) + shift_s
    return columns, environment


def _environment(recording: Recording, columns: Rows) -> Rows:
    """Return the environment of a recording, its runs counted as in `columns`; its own data sets where it has none."""
    source = recording.environment
    runs = np.unique(np.asarray(columns["run"]))
    if not source or "t_s" not in source or "temperature_c" not in source:
        names = [name for name in ("t_s", "run", "temperature_c") if name in recording.columns]
        return {name: np.asarray(recording.columns[name] if name != "run" else columns["run"]) for name in names} | (
            {"run": np.asarray(columns["run"])} if "t_s" in names else {}
        )
    environment_rows = {name: np.asarray(values) for name, values in source.items()}
    if "run" in environment_rows:
        run_numbers = np.unique(np.asarray(recording.columns.get("run", np.ones(1))))
        environment_rows["run"] = (
            np.asarray(environment_rows["run"], dtype=np.int64) - int(run_numbers.min()) + int(runs.min())
        )
        return environment_rows
    repeated = {name: np.tile(values, len(runs)) for name, values in environment_rows.items()}
    return repeated | {"run": np.repeat(runs, len(environment_rows["t_s"]))}


def _below_one_another(tables: Sequence[Rows]) -> Rows:
    names = [name for name in tables[0] if all(name in table for table in tables)]
    return {name: np.concatenate([table[name] for table in tables]) for name in names}


def without_recordings(recording: Recording, numbers: Sequence[int]) -> Recording:
    """Return a joined recording without some of its recordings; its environment stays whole."""
    is_used = ~np.isin(np.asarray(recording.columns[RECORDING]), numbers)
    return replace(recording, columns={name: np.asarray(values)[is_used] for name, values in recording.columns.items()})
