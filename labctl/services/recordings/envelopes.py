"""Envelopes of a recording's readings: least, largest and mean in bins of each data set, made once and cached as files.

With them millions of readings are drawn without being read again.
"""

from __future__ import annotations

import io
from collections.abc import Collection, Mapping
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
#: How the names of channels begin that the unit, its thermometers or the chamber measured; others follow from the plan.
MEASURED = ("gyro_", "accel_", "mag_", "temperature_", "chamber_")
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


def courses_of(columns: Mapping[str, NDArray[np.generic]]) -> list[str]:
    """Return the names of the channels of a data set that can be drawn over time."""
    return [name for name, values in columns.items() if name not in NO_COURSE and values.dtype.kind in "fiu"]


def envelope_of(store: Store, recording: int, channel: str) -> Envelope:
    """Return the envelope of one channel over all complete data sets; empty where none has it.

    They are made when the readings are examined (`EnvelopesMade`). Of a recording that is not examined yet, each
    channel is made when it is asked for: opening a recording waits for one channel, not for twelve.
    """
    question = _question(store.recordings.fingerprint(recording, complete=True), channel)
    return ENVELOPES.get(question, _decoded, lambda: _encoded(_made(store, recording, channel)))


def _question(readings: str, channel: str) -> dict[str, object]:
    return {"kind": "envelope", "readings": readings, "channel": channel}


def _encoded(made: Envelope) -> bytes:
    packed = io.BytesIO()
    bounds: NDArray[np.floating] = np.stack([made.low, made.high, made.mean, made.n])
    if np.all(np.isinf(bounds) | (np.abs(bounds) <= np.finfo(np.float32).max)):  # larger ones are no rates, yet stored
        bounds = bounds.astype(np.float32)
    np.savez(packed, t_s=made.t_s, bounds=bounds)
    return packed.getvalue()


def _decoded(content: bytes) -> Envelope:
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        low, high, mean, n = arrays["bounds"].astype(np.float64)
        return Envelope(arrays["t_s"], low, high, mean, n)


class EnvelopesMade:
    """The envelopes of the channels of a recording, made while another examination reads its data sets in order."""

    def __init__(self, wanted: Collection[str] | None = None) -> None:
        """Make those of the channels `wanted`; None: of each channel that was measured by the unit or the chamber."""
        self._wanted = wanted
        self._parts: dict[str, list[tuple[Array, NDArray[np.float64]]]] = {}

    def add(self, columns: Mapping[str, NDArray[np.generic]]) -> None:
        """Take in the readings, (n,) each, of the next data set."""
        n = len(next(iter(columns.values()), ()))
        channels = [name for name in courses_of(columns) if self._is_wanted(name)]
        if n == 0 or "t_s" not in columns or not channels:
            return
        edges = np.linspace(0, n, bins_of(n) + 1).astype(np.int64)
        begins, width = edges[:-1], np.diff(edges)
        t_s = np.add.reduceat(np.asarray(columns["t_s"], dtype=np.float64), begins) / width
        for name in channels:
            bounds = _bounds(np.asarray(columns[name], dtype=np.float64), begins, width)
            self._parts.setdefault(name, []).append((t_s, bounds))

    def _is_wanted(self, name: str) -> bool:
        return name in self._wanted if self._wanted is not None else name.startswith(MEASURED)

    def envelope(self, channel: str) -> Envelope:
        """Return the envelope of a channel; empty where no data set has it."""
        parts = [(np.zeros(0), np.zeros((4, 0))), *self._parts.get(channel, [])]
        bounds = np.concatenate([bounds for _, bounds in parts], axis=1)
        return Envelope(np.concatenate([t_s for t_s, _ in parts]), *bounds)

    def save(self, store: Store, recording: int) -> None:
        """Cache the envelopes as those of a recording, all complete data sets of which were taken in."""
        readings = store.recordings.fingerprint(recording, complete=True)
        for name in self._parts:
            ENVELOPES.save(ENVELOPES.file(_question(readings, name)), _encoded(self.envelope(name)))


def _made(store: Store, recording: int, channel: str) -> Envelope:
    made = EnvelopesMade({channel})
    for _, columns in store.recordings.iter_datasets(recording):
        made.add(columns)
    return made.envelope(channel)


def _bounds(values: Array, begins: NDArray[np.int64], width: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return least, largest, mean and number of finite values (n,) in each bin, as (4, bins)."""
    is_finite = np.isfinite(values)
    count, low, high, total = width, values, values, values
    if not is_finite.all():  # an instrument may send no number with a reading that it marks as bad
        count = np.add.reduceat(is_finite.astype(np.int64), begins)
        low, high, total = (np.where(is_finite, values, instead) for instead in (np.inf, -np.inf, 0.0))
    with np.errstate(over="ignore"):  # the mean of readings near the largest number is infinite
        mean = np.add.reduceat(total, begins) / np.maximum(count, 1)
    low, high = np.minimum.reduceat(low, begins), np.maximum.reduceat(high, begins)
    return np.stack([low, high, mean, count.astype(np.float64)])
