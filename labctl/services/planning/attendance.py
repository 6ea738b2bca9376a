"""Attendance: when a plan needs a person at the bench, which of these times are at night, and a better start."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from instruments.bench_config import BenchFile
from labctl.answers.plans import AttendanceResponse
from procedures.contracts.steps import Mount, PowerOff, PowerOn, Turn
from procedures.planning.plan import Plan

#: Prompts that follow each other within this are one visit, s.
ONE_VISIT_S = 1800.0
#: Local hours of the night.
NIGHT_FROM_H, NIGHT_UNTIL_H = 20, 7
#: Starts that are compared: every quarter of an hour of the next day.
QUARTER = timedelta(minutes=15)
CANDIDATES = 96
#: Times named in a sentence; the rest is counted.
NAMED = 8
WEEK = timedelta(days=6)


def visits_s(plan: Plan, bench: BenchFile) -> list[float]:
    """Return when a plan asks a person to turn or switch the units, s from its begin; empty without questions."""
    if not bench.needs_person:
        return []
    visits: list[float] = []
    start_s, last_s = 0.0, -math.inf
    for step in plan.steps:
        if isinstance(step, PowerOn | PowerOff | Mount | Turn):
            if start_s - last_s > ONE_VISIT_S:
                visits.append(start_s)
            last_s = start_s
        start_s += step.expected_s
    return visits


def attendance(offsets_s: Sequence[float], start: datetime, zone: ZoneInfo) -> AttendanceResponse | None:
    """Return the clock times of visits for a start, with a better start where some are at night; None for no visit."""
    if not offsets_s:
        return None
    needed = _times(offsets_s, start, zone)
    night = [time for time in needed if _is_night(time)]
    better = _better_start(offsets_s, start, zone, len(night)) if night else None
    return AttendanceResponse(
        start=start.astimezone(zone),
        time_zone=zone.key,
        needed_at=needed,
        at_night=night,
        text=f"needs a person at {_listed(needed)} ({zone.key})",
        warning=_warning(offsets_s, night, better, zone),
        better_start=better,
    )


def _times(offsets_s: Sequence[float], start: datetime, zone: ZoneInfo) -> list[datetime]:
    begun = start.astimezone(UTC)
    return [(begun + timedelta(seconds=offset_s)).astimezone(zone) for offset_s in offsets_s]


def _is_night(time: datetime) -> bool:
    return time.hour >= NIGHT_FROM_H or time.hour < NIGHT_UNTIL_H


def _better_start(offsets_s: Sequence[float], start: datetime, zone: ZoneInfo, at_night: int) -> datetime | None:
    """Return the next start, on a quarter of an hour, with the fewest visits at night; None when none has fewer."""
    quarter_s = QUARTER.total_seconds()
    first = datetime.fromtimestamp(math.ceil(start.timestamp() / quarter_s) * quarter_s, UTC)
    best, fewest = None, at_night
    for candidate in (first + number * QUARTER for number in range(CANDIDATES)):
        count = sum(_is_night(time) for time in _times(offsets_s, candidate, zone))
        if count < fewest:
            best, fewest = candidate.astimezone(zone), count
    return best


def _warning(offsets_s: Sequence[float], night: Sequence[datetime], better: datetime | None, zone: ZoneInfo) -> str:
    if not night:
        return ""
    verb = "is" if len(night) == 1 else "are"
    text = f"{_listed(night)} {verb} between {NIGHT_FROM_H}:00 and {NIGHT_UNTIL_H:02d}:00"
    if better is None:
        return f"{text}; no start has fewer times at night"
    few = sum(_is_night(time) for time in _times(offsets_s, better, zone))
    return f"{text}; a start at {better:%a %H:%M} needs {'no person at night' if not few else f'only {few} at night'}"


def _listed(times: Sequence[datetime]) -> str:
    """Write times as `Tue 03:10 and Tue 09:40`, with dates where weekdays would repeat."""
    form = "%a %H:%M" if times[-1] - times[0] < WEEK else "%a %d %b %H:%M"
    texts = [f"{time:{form}}" for time in times[:NAMED]]
    if len(times) > NAMED:
        return f"{', '.join(texts)} and {len(times) - NAMED} more"
    return " and ".join(filter(None, (", ".join(texts[:-1]), texts[-1])))
