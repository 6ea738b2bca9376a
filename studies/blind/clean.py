"""Clean records that are awkward: nothing in them is broken, whatever they look like."""

from __future__ import annotations

import numpy as np

from studies.blind.records import (
    Record,
    fast_rest,
    filtered,
    log_uniform,
    output,
    profile,
    rates,
    rest,
    rounded,
    temperatures,
)


def plain(rng: np.random.Generator) -> Record:
    maker = (rest, rest, rates, rates, fast_rest)[int(rng.integers(5))]
    return maker(rng)


def rate_steps(rng: np.random.Generator) -> Record:
    return profile(rng)


def long_soak(rng: np.random.Generator) -> Record:
    """Hours in a chamber at one or two temperatures, once a second or slower."""
    record = rest(rng)
    stretch = 5.0 * 3600.0 / record.t_s[-1]
    record.t_s = np.round(record.t_s * stretch, 3)
    record.rate_hz = 1.0 / float(np.median(np.diff(record.t_s)))
    return record


def fast_ramp(rng: np.random.Generator) -> Record:
    """A chamber at 3 to 8 K/min, and the bias with it."""
    record = rest(rng)
    minutes = record.t_s / 60.0
    swing = rng.uniform(3.0, 8.0) * np.abs((minutes + 7.0) % 14.0 - 7.0)
    record.temperature = np.round(rng.uniform(-20.0, 20.0) + swing, 3)
    for axis, values in record.gyro.items():
        slope = record.sigma[axis] * rng.uniform(0.02, 0.3)
        record.gyro[axis] = rounded(values + slope * filtered(swing, np.exp(-1 / (60.0 * record.rate_hz))), record.lsb)
    return record


def coarse(rng: np.random.Generator) -> Record:
    """An honest step of 0.8 to 1.5 standard deviations: the noise still carries the mean across it."""
    record = (rest, rates)[int(rng.integers(2))](rng)
    record.lsb = min(record.sigma.values()) * rng.uniform(0.8, 1.5)
    record.gyro = {axis: rounded(values, record.lsb) for axis, values in record.gyro.items()}
    return record


def jitter(rng: np.random.Generator) -> Record:
    """Stamps of a computer: each reading a little early or late, to the millisecond or finer."""
    record = rest(rng)
    share = rng.uniform(0.02, 0.2)
    stamps = record.t_s + rng.uniform(-share, share, record.size) / record.rate_hz
    record.t_s = np.round(stamps - stamps[0], 6 if record.rate_hz > 20 else 3)
    return record


def slow_thermometer(rng: np.random.Generator) -> Record:
    """A thermometer asked every 5 to 60 s, its last value kept."""
    record = rest(rng)
    every = max(2, round(rng.uniform(5.0, 60.0) * record.rate_hz))
    record.temperature = record.temperature[(np.arange(record.size) // every) * every]
    return record


def blank_thermometer(rng: np.random.Generator) -> Record:
    """A thermometer asked every few readings, with empty cells between."""
    record = rest(rng)
    every = max(2, round(rng.uniform(1.0, 10.0) * record.rate_hz))
    record.temperature = np.where(np.arange(record.size) % every == 0, record.temperature, np.nan)
    return record


def through_zero(rng: np.random.Generator) -> Record:
    """A soak that passes 0 deg C, with a thermometer of 0.5 K: honest zeros."""
    record = rest(rng)
    course = temperatures(rng, record.t_s, "cold")
    record.temperature = np.round(course * 2.0) / 2.0
    return record


def hot(rng: np.random.Generator) -> Record:
    """A soak at 60 to 99 deg C: an honest 85."""
    record = rest(rng)
    record.temperature = np.round(temperatures(rng, record.t_s, "hot"), 1)
    return record


def band_limited(rng: np.random.Generator) -> Record:
    """An output that its own low-pass has smoothed: neighbours are alike, everywhere."""
    record = fast_rest(rng)
    keep = rng.uniform(0.3, 0.9)
    for axis, values in record.gyro.items():
        record.gyro[axis] = rounded(filtered(values, keep), record.lsb * 0.2)
    return record


def large_bias(rng: np.random.Generator) -> Record:
    """A bias of 5 to 30 deg/s at rest, on one axis."""
    record = rest(rng)
    axis = str(rng.choice(list(record.gyro)))
    record.gyro[axis] = record.gyro[axis] + rounded(np.full(record.size, rng.uniform(5.0, 30.0)), record.lsb)
    return record


def unequal_axes(rng: np.random.Generator) -> Record:
    """One axis of another kind of gyro: 10 to 100 times the noise, 0.5 deg/s at most."""
    record = rest(rng)
    axis = str(rng.choice(list(record.gyro)))
    factor = min(log_uniform(rng, 10.0, 100.0), 0.5 / record.sigma[axis])
    middle = np.median(record.gyro[axis])
    record.gyro[axis] = rounded(middle + (record.gyro[axis] - middle) * factor, record.lsb)
    record.sigma[axis] *= factor
    return record


def pause(rng: np.random.Generator) -> Record:
    """Two sessions at the table with an hour between, as data sets: the pause is between data sets."""
    record = rates(rng)
    assert record.dataset is not None
    half = record.dataset > np.median(record.dataset)
    record.t_s = record.t_s + np.where(half, np.round(rng.uniform(600.0, 7200.0), 1), 0.0)
    return record


def heavy_drift(rng: np.random.Generator) -> Record:
    """A warm-up of the bias of 20 to 200 standard deviations, 1.5 deg/s at most: slow, and true."""
    record = rest(rng)
    for axis, values in record.gyro.items():
        size = record.sigma[axis] * rng.uniform(20.0, 200.0)
        size = min(size, 1.5) * rng.choice((-1.0, 1.0))
        tau = rng.uniform(0.1, 0.4) * record.t_s[-1]
        record.gyro[axis] = rounded(values + size * (1.0 - np.exp(-record.t_s / tau)), record.lsb)
    return record


def alike_axes(rng: np.random.Generator) -> Record:
    """Three axes that share their drift with temperature: correlated, not copies."""
    record = rest(rng)
    common = output(
        rng, Record("rest", record.t_s, {}, record.temperature, {}, record.rate_hz), "x", "mems", record.t_s * 0
    )
    common = filtered(common - common[0], 0.98)
    for axis, values in record.gyro.items():
        record.gyro[axis] = rounded(values + common * rng.uniform(0.5, 2.0) * record.sigma[axis], record.lsb)
    return record


CLEAN = {
    "plain": plain,
    "rate_steps": rate_steps,
    "long_soak": long_soak,
    "fast_ramp": fast_ramp,
    "coarse": coarse,
    "jitter": jitter,
    "slow_thermometer": slow_thermometer,
    "blank_thermometer": blank_thermometer,
    "through_zero": through_zero,
    "hot": hot,
    "band_limited": band_limited,
    "large_bias": large_bias,
    "unequal_axes": unequal_axes,
    "pause": pause,
    "heavy_drift": heavy_drift,
    "alike_axes": alike_axes,
}
