"""Faults of the outputs of a gyro, and lines in them.

The law of the sizes, in a few words: a fault is made large enough that an engineer who plots the record would stop and
ask, and that a fit of the record would be wrong by more than its noise; it is not made larger than that on purpose.
Each function says its own.
"""

from __future__ import annotations

import numpy as np

from studies.blind.places import either, hit_axes, moving, some_axis, stretch
from studies.blind.records import Record, fast_rest, log_uniform, rest, rounded


def frozen(rng: np.random.Generator) -> Record:
    """2 to 50 % of the readings, 60 at least, hold the last value; one axis or all."""
    record = either(rng)
    part = stretch(rng, record, 0.02, 0.5)
    for axis in hit_axes(rng, record):
        record.gyro[axis][part] = record.gyro[axis][part.start - 1]
    return record


def frozen_set(rng: np.random.Generator) -> Record:
    """One data set of a rate table holds the last value of the set before it."""
    record = moving(rng)
    assert record.dataset is not None
    chosen = record.dataset == rng.integers(2, record.dataset.max() + 1)
    for axis in hit_axes(rng, record):
        record.gyro[axis][chosen] = record.gyro[axis][np.argmax(chosen) - 1]
    return record


def clipped(rng: np.random.Generator) -> Record:
    """The output ends at 60 to 97 % of the highest rate of the table."""
    record = moving(rng)
    top = max(float(np.max(np.abs(values))) for values in record.gyro.values())
    limit = round(top * rng.uniform(0.6, 0.97), 3)
    record.gyro = {axis: np.clip(values, -limit, limit) for axis, values in record.gyro.items()}
    return record


def clipped_noise(rng: np.random.Generator) -> Record:
    """At rest the output sits at a rail: 5 to 40 % of the readings of an axis are the same end value."""
    record = rest(rng)
    axis = some_axis(rng, record)
    rail = np.quantile(record.gyro[axis], rng.uniform(0.6, 0.95))
    record.gyro[axis] = np.minimum(record.gyro[axis], rail)
    return record


def moved(rng: np.random.Generator) -> Record:
    """The unit turns at 0.3 to 5 deg/s (20 standard deviations at least) for 5 to 60 s, 5 readings at least."""
    record = rest(rng)
    rate = max(log_uniform(rng, 0.3, 5.0), 20.0 * max(record.sigma.values())) * rng.choice((-1.0, 1.0))
    length = max(5, round(rng.uniform(5.0, 60.0) * record.rate_hz))
    start = int(rng.integers(0, max(1, record.size - length)))
    direction = rng.normal(size=3)
    for axis, share in zip(record.gyro, direction / np.max(np.abs(direction[: len(record.gyro)])), strict=False):
        record.gyro[axis][start : start + length] += rounded(np.full(1, rate * share), record.lsb)
    return record


def nudged(rng: np.random.Generator) -> Record:
    """A person walks against the bench: a rate that swings once or twice in 1 to 5 s.

    It is 30 to 300 standard deviations, 5 deg/s at most.
    """
    record = fast_rest(rng)
    length = min(int(rng.uniform(1.0, 5.0) * record.rate_hz), record.size // 3)
    start = int(rng.integers(0, record.size - length))
    pulse = np.sin(np.linspace(0.0, 2 * np.pi * rng.integers(1, 3), length)) * np.hanning(length)
    for axis in record.gyro:
        pulse_size = record.sigma[axis] * min(log_uniform(rng, 30.0, 300.0), 5.0 / record.sigma[axis])
        record.gyro[axis][start : start + length] += rounded(pulse * pulse_size, record.lsb)
    return record


def spikes(rng: np.random.Generator) -> Record:
    """3 to 40 single readings off by 15 to 1000 standard deviations."""
    record = either(rng)
    axis = some_axis(rng, record)
    rows = rng.choice(record.size, int(rng.integers(3, 41)), replace=False)
    size = [record.sigma[axis] * log_uniform(rng, 15.0, 1000.0) * rng.choice((-1.0, 1.0)) for _ in rows]
    record.gyro[axis][rows] += rounded(np.asarray(size), record.lsb)
    return record


def garbage(rng: np.random.Generator) -> Record:
    """3 to 40 readings whose bytes were shifted: any number of 16 bits, in steps of the unit's range."""
    record = either(rng)
    scale = max(record.lsb, 500.0 / 32768.0)
    rows = rng.choice(record.size, int(rng.integers(3, 41)), replace=False)
    for axis in record.gyro:
        record.gyro[axis][rows] = rng.integers(-32768, 32768, len(rows)) * scale
    return record


def quantised(rng: np.random.Generator) -> Record:
    """Steps of 0.05 to 1 deg/s at rest, 2.5 to 12 standard deviations: most readings are one of two values."""
    record = rest(rng)
    noise = max(record.sigma.values())
    record.lsb = max(noise * rng.uniform(2.5, 12.0), log_uniform(rng, 0.05, 0.3))
    record.gyro = {axis: rounded(values, record.lsb) for axis, values in record.gyro.items()}
    return record


def mains(rng: np.random.Generator) -> Record:
    """50 or 60 Hz, or twice that, of 0.5 to 8 standard deviations: itself, or its alias."""
    record = fast_rest(rng)
    return line(rng, record, float(rng.choice((50.0, 60.0, 100.0, 120.0))) + rng.normal(0.0, 0.02))


def vibration(rng: np.random.Generator) -> Record:
    """A line anywhere between 5 and 45 % of the sampling rate, 0.5 to 8 standard deviations: a fan, a pump."""
    record = (fast_rest, rest)[int(rng.integers(2))](rng)
    return line(rng, record, record.rate_hz * rng.uniform(0.05, 0.45))


def line(rng: np.random.Generator, record: Record, frequency: float) -> Record:
    for axis in hit_axes(rng, record):
        size = record.sigma[axis] * log_uniform(rng, 0.5, 8.0)
        wave = size * np.sin(2 * np.pi * frequency * record.t_s + rng.uniform(0.0, 6.28))
        record.gyro[axis] = rounded(record.gyro[axis] + wave, record.lsb)
    return record
