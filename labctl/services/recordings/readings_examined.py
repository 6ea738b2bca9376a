"""The examination of the single readings of a stored recording, computed once for the readings that it holds."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from labctl.answers.inspection import ReadingsExamined
from labctl.recording import Recording
from labctl.recording.recording import Columns
from labctl.recording.sanity.readings import examination, joined_examinations
from labctl.services.cache import cached
from labctl.services.recordings.envelopes import EnvelopesMade
from labctl.services.recordings.warnings import warning_of
from labctl.store import RecordingRow, Store

#: Readings that are examined together, at most, where a recording is not in memory already.
READINGS_TOGETHER = 2_000_000


def examined_stored(store: Store, row: RecordingRow, recording: Recording | None = None) -> ReadingsExamined:
    """Return what is wrong with single readings of a recording; nothing for means and tables of coefficients.

    `recording` is the whole recording, where it is in memory already.
    """
    question = {"examine": row.id, "readings": store.recordings.fingerprint(row.id, head=row)}
    return cached(ReadingsExamined, question, lambda: _examined(store, row, recording))


def _examined(store: Store, row: RecordingRow, recording: Recording | None) -> ReadingsExamined:
    if row.kind != "samples":
        return ReadingsExamined(warnings=[], courses=[], marks=[])
    made = EnvelopesMade()
    if recording is not None:
        result = examination(recording)
        for columns in _sets_of(recording):
            made.add(columns)
    else:
        info = row.recording_info
        together = _together(store, row.id, made)
        result = joined_examinations([examination(Recording(info, columns)) for columns in together])
    made.save(store, row.id)
    return ReadingsExamined(
        warnings=[warning_of(finding) for finding in result.findings], courses=result.courses, marks=result.marks
    )


def _sets_of(recording: Recording) -> Iterator[Columns]:
    """Yield the readings of each data set in their order; nothing where they are not in the order of their numbers."""
    number = np.asarray(recording.columns.get("dataset", np.zeros(0)), dtype=np.int64)
    if len(number) == 0 or np.any(np.diff(number) < 0):
        return
    edges = [0, *(np.flatnonzero(np.diff(number)) + 1).tolist(), len(number)]
    for begin, end in pairwise(edges):
        yield {name: values[begin:end] for name, values in recording.columns.items()}


def _together(store: Store, recording: int, made: EnvelopesMade) -> Iterator[Columns]:
    """Yield the readings of consecutive data sets, of many at once; each is taken into `made`."""
    parts: list[Columns] = []
    n = 0
    for _, columns in store.recordings.iter_datasets(recording):
        made.add(columns)
        length = len(columns["t_s"]) if "t_s" in columns else 0
        if n and n + length > READINGS_TOGETHER:
            yield _one(parts)
            parts, n = [], 0
        if length:
            parts.append(columns)
            n += length
    if parts:
        yield _one(parts)


def _one(parts: list[Columns]) -> Columns:
    names = [name for name in parts[0] if all(name in part for part in parts)]
    return {name: np.concatenate([part[name] for part in parts]) for name in names}
