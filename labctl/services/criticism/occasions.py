"""When the recordings of a unit were made: those with a date in order of time, and the occasions that a trend takes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import timedelta

from labctl.recording.info import GIVE_DATE, measured_at, ordered_at
from labctl.store import RecordingRow, Store

#: Recordings that begin less than this after the end of an earlier one are of one occasion.
LEAST_APART = timedelta(days=1)


def in_time(rows: Iterable[RecordingRow]) -> tuple[list[RecordingRow], list[RecordingRow]]:
    """Return the recordings in order of time, of one instant by their numbers, and those whose date is not known."""
    every = sorted(rows, key=lambda row: (ordered_at(row.info), row.id))
    return [r for r in every if measured_at(r.info)], [r for r in every if not measured_at(r.info)]


def occasions_of(store: Store, measured: Sequence[RecordingRow]) -> list[list[int]]:
    """Return the numbers of recordings, in order of time, by occasion: those that overlap or are close are of one."""
    found: list[list[int]] = []
    reached = None
    for row in measured:
        begun = ordered_at(row.info)
        if reached is None or begun >= reached + LEAST_APART:
            found.append([])
        found[-1].append(row.id)
        ends = [each.t_until_s for each in store.recordings.data_sets(row.id) if each.t_until_s is not None]
        until = begun + timedelta(seconds=max(ends, default=0.0))
        reached = until if reached is None else max(reached, until)
    return found


def occasions_text(occasions: Sequence[Sequence[int]], *, drifted: bool) -> Iterator[str]:
    """Yield why recordings of one occasion show no drift."""
    if len(occasions) == 1 and len(occasions[0]) > 1:
        yield (
            f"Recordings {_numbers(occasions[0])} overlap in time or are less than {LEAST_APART.days * 24} h apart: "
            "they are one occasion, and show no drift over the years; record the unit again on another day."
        )
    elif len(occasions) > 1 and not drifted:
        yield "A drift needs two recordings that the version can be applied to, and its uncertainty three."


def undated_text(rows: Sequence[RecordingRow]) -> Iterator[str]:
    """Yield which recordings are left out because their date is not known, and what to do."""
    if rows:
        word, has = ("Recordings", "have") if len(rows) > 1 else ("Recording", "has")
        yield (
            f"{word} {_numbers([row.id for row in rows])} {has} no date of measurement and cannot be put in order of "
            f"time; {GIVE_DATE}."
        )


def _numbers(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))
