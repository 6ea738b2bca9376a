"""Where a fault is put: an axis, a part of the rows, a record of the kind that can have it."""

from __future__ import annotations

import numpy as np

from studies.blind.records import Record, log_uniform, rates, rest


def some_axis(rng: np.random.Generator, record: Record) -> str:
    return str(rng.choice(list(record.gyro)))


def hit_axes(rng: np.random.Generator, record: Record) -> list[str]:
    """One axis, or all of them."""
    return list(record.gyro) if rng.random() < 0.4 else [some_axis(rng, record)]


def stretch(rng: np.random.Generator, record: Record, low: float, high: float, least: int = 60) -> slice:
    """A part of the rows, its share log-uniform between two limits, its place anywhere."""
    length = min(max(least, int(record.size * log_uniform(rng, low, high))), record.size - 2)
    start = int(rng.integers(1, record.size - length))
    return slice(start, start + length)


def cut(rng: np.random.Generator, record: Record) -> int:
    """A row between 15 and 85 % of the record."""
    return int(record.size * rng.uniform(0.15, 0.85))


def either(rng: np.random.Generator) -> Record:
    return (rest, rates)[int(rng.integers(2))](rng)


def moving(rng: np.random.Generator, axes: tuple[str, ...] | None = None) -> Record:
    return rates(rng, axes=axes)


def three_at_rest(rng: np.random.Generator) -> Record:
    while True:
        record = rest(rng)
        if len(record.gyro) == 3:
            return record
