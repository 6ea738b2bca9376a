"""Envelopes of a recording's readings: least, largest and mean in bins of each data set, made once, kept as a file.

They let millions of readings be drawn without reading them again. A file is named by all that it depends on, as kept
answers are; a damaged or missing one only costs the time to make it again.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

from labctl.services.kept import code_digest, one_at_a_time, write_kept
from labctl.store import Store

#: Bins of a data set: so many, or one for this many readings where it is far longer than others, up to a limit.
LEAST_BINS, READINGS_A_BIN, MOST_BINS = 64, 128, 4096
#: A file has some 100 bytes a bin and ten channels; the oldest go when there are more.
MOST_FILES = 20
#: Columns that are no measured course.
NO_COURSE = frozenset({"dataset", "t_s", "run", "mounting", "valid"})

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
    return min(max(LEAST_BINS, readings // READINGS_A_BIN), MOST_BINS, readings)


def courses_of(columns: dict[str, NDArray[Any]]) -> list[str]:
    """Return the names of the channels of a data set that can be drawn over time."""
    return [name for name, values in columns.items() if name not in NO_COURSE and values.dtype.kind in "fiu"]


def envelope_of(store: Store, recording: int, channel: str) -> Envelope:
    """Return the envelope of one channel over all complete data sets; empty where none has it."""
    asked = f"envelopes {code_digest()} {store.recordings.fingerprint(recording, complete=True)}"
    name = hashlib.sha256(asked.encode()).hexdigest()
    file = user_cache_path("labctl") / "envelopes" / f"{name}.npz"
    if (found := _read(file, channel)) is not None:
        return found
    with one_at_a_time(asked):
        if (found := _read(file, channel)) is not None:
            return found
        packed = io.BytesIO()
        np.savez(packed, **_made(store, recording))  # type: ignore[arg-type]  # names are the channels'
        with suppress(OSError):
            write_kept(file, packed.getvalue(), MOST_FILES)
    packed.seek(0)
    return _taken(packed, channel)


def _read(file: Path, channel: str) -> Envelope | None:
    try:
        with file.open("rb") as source:
            found = _taken(source, channel)
        file.touch()
        return found
    except (OSError, EOFError, ValueError, KeyError, BadZipFile):
        return None


def _taken(source: IO[bytes], channel: str) -> Envelope:
    with np.load(source, allow_pickle=False) as arrays:
        t_s = arrays["t_s"]
        if f"channel {channel}" not in arrays:
            return Envelope(*(np.zeros(0) for _ in range(5)))
        low, high, mean, n = arrays[f"channel {channel}"].astype(np.float64)
        return Envelope(t_s, low, high, mean, n)


def _made(store: Store, recording: int) -> dict[str, NDArray[Any]]:
    """Return the middle times of all bins, (k,), and for each channel least, largest, mean and number, (4, k)."""
    times, parts = [], []
    for t_s, part in _of_sets(store, recording):
        times.append(t_s)
        parts.append(part)
    found: dict[str, NDArray[Any]] = {"t_s": np.concatenate(times) if times else np.zeros(0)}
    for name in dict.fromkeys(name for part in parts for name in part):
        rows = [part.get(name, np.zeros((4, len(t)), dtype=np.float32)) for part, t in zip(parts, times, strict=True)]
        found[f"channel {name}"] = np.concatenate(rows, axis=1)
    return found


def _of_sets(store: Store, recording: int) -> Iterator[tuple[Array, dict[str, NDArray[np.float32]]]]:
    for _, columns in store.recordings.iter_datasets(recording):
        names = courses_of(columns)
        n = len(next(iter(columns.values()), ()))
        if n == 0 or not names or "t_s" not in columns:
            continue
        edges = np.linspace(0, n, bins_of(n) + 1).astype(np.int64)
        begins, width = edges[:-1], np.diff(edges)
        t_s = np.add.reduceat(np.asarray(columns["t_s"], dtype=np.float64), begins) / width
        stack = np.stack([np.asarray(columns[name], dtype=np.float64) for name in names])
        yield t_s, dict(zip(names, _bounds(stack, begins, width), strict=True))


def _bounds(stack: Array, begins: NDArray[np.int64], width: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return least, largest, mean and number of finite values (c, n) in each bin, as (c, 4, bins)."""
    there = np.isfinite(stack)
    if there.all():
        count = np.broadcast_to(width, (len(stack), len(width)))
        low, high, total = stack, stack, stack
    else:  # an instrument may send no number with a reading that it marks as bad
        count = np.add.reduceat(there.astype(np.int64), begins, axis=1)
        low, high = np.where(there, stack, np.inf), np.where(there, stack, -np.inf)
        total = np.where(there, stack, 0.0)
    bounds = np.stack(
        [
            np.minimum.reduceat(low, begins, axis=1),
            np.maximum.reduceat(high, begins, axis=1),
            np.add.reduceat(total, begins, axis=1) / np.maximum(count, 1),
            count,
        ],
        axis=1,
    )
    return bounds.astype(np.float32)
