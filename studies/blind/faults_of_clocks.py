"""Faults of time stamps, of rows and of thermometers; the law of their sizes is that of `faults_of_outputs`."""

from __future__ import annotations

import numpy as np

from studies.blind.places import cut, either, stretch
from studies.blind.records import Record, log_uniform, rest


def dead_thermometer(rng: np.random.Generator) -> Record:
    """-127 deg C (a 1-wire thermometer that does not answer), singly or for a while; 1 to 30 % of the readings."""
    return thermometer_code(rng, -127.0)


def zero_thermometer(rng: np.random.Generator) -> Record:
    """Zeros, singly or for a while, in a room."""
    return thermometer_code(rng, 0.0)


def power_on_85(rng: np.random.Generator) -> Record:
    """85 deg C, the power-on value of a 1-wire thermometer, singly or for a while, in a room."""
    return thermometer_code(rng, 85.0)


def thermometer_code(rng: np.random.Generator, code: float) -> Record:
    record = either(rng)
    while np.min(record.temperature) < 8.0 or np.max(record.temperature) > 70.0:
        record = either(rng)
    if rng.random() < 0.5:
        record.temperature[rng.random(record.size) < log_uniform(rng, 0.002, 0.1)] = code
        record.temperature[int(rng.integers(record.size))] = code
    else:
        record.temperature[stretch(rng, record, 0.01, 0.3)] = code
    return record


def stuck_thermometer(rng: np.random.Generator) -> Record:
    """The thermometer stays for 20 to 50 % of a loop of 10 K or more, then jumps to the true value: 3 K at least."""
    for _ in range(200):
        record = rest(rng)
        part = stretch(rng, record, 0.2, 0.5)
        held = record.temperature[part.start]
        if np.ptp(record.temperature) > 10.0 and abs(record.temperature[part.stop] - held) > 3.0:
            break
    record.temperature[part] = held
    return record


def fahrenheit(rng: np.random.Generator) -> Record:
    """The thermometer reads deg F for 10 to 60 % of the record, from 5 deg C upwards."""
    record = either(rng)
    while np.min(record.temperature) < 5.0:
        record = either(rng)
    part = stretch(rng, record, 0.1, 0.6)
    record.temperature[part] = np.round(record.temperature[part] * 1.8 + 32.0, 2)
    return record


def dropped(rng: np.random.Generator) -> Record:
    """0.3 to 8 % of the readings are missing, singly or in bursts of 2 to 40; the stamps are true."""
    record = either(rng)
    share, burst = log_uniform(rng, 0.003, 0.08), int(rng.choice((1, int(rng.integers(2, 41)))))
    lost = np.zeros(record.size, bool)
    for start in rng.choice(record.size - burst, max(3, round(share * record.size / burst)), replace=False):
        lost[start : start + burst] = True
    lost[0] = lost[-1] = False
    record.take(~lost)
    return record


def gap(rng: np.random.Generator) -> Record:
    """One hole of 3 to 30 % of a rest record."""
    record = rest(rng)
    part = stretch(rng, record, 0.03, 0.3)
    record.take(np.r_[0 : part.start, part.stop : record.size])
    return record


def repeated_rows(rng: np.random.Generator) -> Record:
    """0.5 to 10 % of the lines are there twice, stamp and all; singly, or a block written twice."""
    record = either(rng)
    if rng.random() < 0.5:
        times = 1 + (rng.random(record.size) < log_uniform(rng, 0.005, 0.1))
        times[5] = 2
        record.take(np.repeat(np.arange(record.size), times))
    else:
        part = stretch(rng, record, 0.01, 0.1)
        record.take(np.r_[0 : part.stop, part.start : record.size])
    return record


def repeated_values(rng: np.random.Generator) -> Record:
    """The unit is asked more often than it measures: all readings 2 to 5 times, or 3 to 20 % of them twice."""
    record = either(rng)
    if rng.random() < 0.5:
        source = (np.arange(record.size) // int(rng.integers(2, 6))) * 1
        for axis, values in record.gyro.items():
            record.gyro[axis] = values[source]
            record.gyro[axis] = values[np.minimum(source * (record.size // (source[-1] + 1)), record.size - 1)]
    else:
        stale = rng.random(record.size) < rng.uniform(0.03, 0.2)
        stale[0] = False
        source = np.maximum.accumulate(np.where(stale, 0, np.arange(record.size)))
        record.gyro = {axis: values[source] for axis, values in record.gyro.items()}
    return record


def time_back(rng: np.random.Generator) -> Record:
    """One to five times the stamps go back by 2 to 200 readings, and go on from there."""
    record = either(rng)
    for start in rng.choice(record.size - 10, int(rng.integers(1, 6)), replace=False) + 5:
        record.t_s[start:] -= rng.integers(2, 201) / record.rate_hz
    return record


def restarted(rng: np.random.Generator) -> Record:
    """The logger starts again in the middle: its stamps begin at zero again."""
    record = either(rng)
    place = cut(rng, record)
    record.t_s[place:] -= record.t_s[place]
    return record


def swapped_lines(rng: np.random.Generator) -> Record:
    """1 to 20 blocks of 1 to 30 lines changed places with the next block."""
    record = either(rng)
    order = np.arange(record.size)
    for _ in range(int(rng.integers(1, 21))):
        length = int(rng.integers(1, 31))
        start = int(rng.integers(0, record.size - 2 * length))
        order[start : start + 2 * length] = np.roll(order[start : start + 2 * length], length)
    record.take(order)
    return record


def clock_step(rng: np.random.Generator) -> Record:
    """The clock is set forward while readings go on: by 5 s to a day, 20 readings at least."""
    record = rest(rng)
    record.t_s[cut(rng, record) :] += max(log_uniform(rng, 5.0, 86400.0), 20.0 / record.rate_hz)
    return record


def clock_step_back(rng: np.random.Generator) -> Record:
    """The clock is set back while readings go on: by 1 s to an hour, 5 readings at least."""
    record = rest(rng)
    record.t_s[cut(rng, record) :] -= max(log_uniform(rng, 1.0, 3600.0), 5.0 / record.rate_hz)
    return record


def counter_overflow(rng: np.random.Generator) -> Record:
    """The stamp is a counter of 16 bits of milliseconds or of 32 bits of microseconds, and wraps."""
    record = either(rng)
    period = float(rng.choice((65.536, 4294.967296)))
    if record.t_s[-1] < 1.3 * period:
        period = 65.536
    record.t_s = np.round((record.t_s + rng.uniform(0.0, period)) % period, 6)
    return record


def time_unit_changed(rng: np.random.Generator) -> Record:
    """From a row on the stamps are in ms under a heading of s."""
    record = rest(rng)
    record.t_s[max(cut(rng, record), 10) :] *= 1000.0
    return record


def rate_changed(rng: np.random.Generator) -> Record:
    """The unit samples 2 to 10 times slower, or faster, from a row on."""
    record = rest(rng, rows=9000)
    place, factor = cut(rng, record), int(rng.choice((2, 4, 5, 10)))
    rows = np.arange(record.size)
    slow = (rows >= place) if rng.random() < 0.5 else (rows < place)
    record.take(~slow | (rows % factor == 0))
    return record


def batched_stamps(rng: np.random.Generator) -> Record:
    """Readings come in packets of 4 to 25, all with the stamp of the packet."""
    record = rest(rng)
    size = int(rng.integers(4, 26))
    record.t_s = record.t_s[np.minimum((np.arange(record.size) // size + 1) * size, record.size - 1)]
    return record
