"""Envelopes of a recording's readings: least, largest and mean in bins of each data set, made once and cached as files.

With them millions of readings are drawn without being read again.
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.recording.columns import VERIFICATION
from labctl.services.cache import FileCache
from labctl.store import Store

#: Bins of a data set: so many, or one for this many readings where it is far longer than others, up to a limit.
MIN_BINS, READINGS_A_BIN, MAX_BINS = 64, 128, 4096
#: A file has some 24 bytes a bin, and a recording up to a dozen files.
ENVELOPES = FileCache("envelopes", ".npz", most=200)
#: Columns that are no measured channel over time.
NO_COURSE = frozenset({"dataset", "t_s", "run", "mounting", VERIFICATION, "valid"})

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Envelope:
    """One channel in bins in the order of time, (k,) each: middle time, least, largest, mean, number of readings."""

    t_s: Array
    low: Array
    high: Array
    mean: Array
    n: Array


def bins_of(readings: int) -> int:
    """Return how many bins a data set of so many readings has."""
    return min(max(MIN_BINS, readings // READINGS_A_BIN), MAX_BINS, readings)


def courses_of(columns: dict[str, NDArray[np.generic]]) -> list[str]:
    """Return the names of the channels of a data set that can be drawn over time."""
    return [name for name, values in columns.items() if name not in NO_COURSE and values.dtype.kind in "fiu"]


def envelope_of(store: Store, recording: int, channel: str) -> Envelope:
    """Return the envelope of one channel over all complete data sets; empty where none has it.

    Each channel is made when it is asked for: opening a recording waits for one channel, not for twelve.
    """
    readings = store.recordings.fingerprint(recording, complete=True)
    question = {"kind": "envelope", "readings": readings, "channel": channel}
    return ENVELOPES.get(question, _decoded, lambda: _encoded(_made(store, recording, channel)))


def _encoded(made: Envelope) -> bytes:
    packed = io.BytesIO()
    np.savez(packed, t_s=made.t_s, bounds=np.stack([made.low, made.high, made.mean, made.n]).astype(np.float32))
    return packed.getvalue()


def _decoded(content: bytes) -> Envelope:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        low, high, mean, n = arrays["bounds"].astype(np.float64)
        return Envelope(arrays["t_s"], low, high, mean, n)


def _made(store: Store, recording: int, channel: str) -> Envelope:
    times, parts = [np.zeros(0)], [np.zeros((4, 0))]
    for _, columns in store.recordings.iter_datasets(recording):
        n = len(next(iter(columns.values()), ()))
        if n == 0 or "t_s" not in columns or channel not in courses_of(columns):
            continue
        edges = np.linspace(0, n, bins_of(n) + 1).astype(np.int64)
        begins, width = edges[:-1], np.diff(edges)
        times.append(np.add.reduceat(np.asarray(columns["t_s"], dtype=np.float64), begins) / width)
        parts.append(_bounds(np.asarray(columns[channel], dtype=np.float64), begins, width))
    return Envelope(np.concatenate(times), *np.concatenate(parts, axis=1))


def _bounds(values: Array, begins: NDArray[np.int64], width: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return least, largest, mean and number of finite values (n,) in each bin, as (4, bins)."""
    is_finite = np.isfinite(values)
    count, low, high, total = width, values, values, values
    if not is_finite.all():  # an instrument may send no number with a reading that it marks as bad
        count = np.add.reduceat(is_finite.astype(np.int64), begins)
        low, high, total = (np.where(is_finite, values, instead) for instead in (np.inf, -np.inf, 0.0))
    return np.stack(
        [
            np.minimum.reduceat(low, begins),
            np.maximum.reduceat(high, begins),
            np.add.reduceat(total, begins) / np.maximum(count, 1),
            count.astype(np.float64),
        ]
    )
