"""Faults of a part of a record, or of columns that do not belong together; sizes as in `faults_of_outputs`."""

from __future__ import annotations

import numpy as np

from studies.blind.places import cut, either, hit_axes, moving, some_axis, stretch, three_at_rest
from studies.blind.records import Record, filtered, log_uniform, output, rest, rounded


def mixed_units(rng: np.random.Generator) -> Record:
    """From a row on the output is rad/s under a heading of deg/s, or the other way round; one axis or all."""
    record = either(rng)
    place, factor = cut(rng, record), float(rng.choice((np.pi / 180.0, 180.0 / np.pi)))
    for axis in hit_axes(rng, record):
        record.gyro[axis][place:] *= factor
    return record


def copied(rng: np.random.Generator) -> Record:
    """An axis is another one, or 0.5, 2, -1 or any multiple of it, with an offset in a third of the cases."""
    record = three_at_rest(rng) if rng.random() < 0.6 else moving(rng, ("x", "y", "z"))
    source, target = (str(name) for name in rng.choice(list(record.gyro), 2, replace=False))
    factor = float(rng.choice((1.0, 1.0, 0.5, 2.0, -1.0, rng.uniform(0.2, 3.0))))
    offset = rng.normal(0.0, 1.0) if rng.random() < 0.33 else 0.0
    record.gyro[target] = record.gyro[source] * factor + offset
    return record


def axes_swapped(rng: np.random.Generator) -> Record:
    """Two axes change places from a row on: on a table, or at rest with biases 20 standard deviations apart."""
    if rng.random() < 0.7:
        record = moving(rng, ("x", "y", "z"))
    else:
        record = three_at_rest(rng)
        for index, axis in enumerate(record.gyro):
            record.gyro[axis] = record.gyro[axis] + index * 20.0 * max(record.sigma.values())
    place = cut(rng, record)
    first, second = (str(name) for name in rng.choice(list(record.gyro), 2, replace=False))
    kept = record.gyro[first][place:].copy()
    record.gyro[first][place:] = record.gyro[second][place:]
    record.gyro[second][place:] = kept
    return record


def sign_flipped(rng: np.random.Generator) -> Record:
    """The output changes sign from a row on: on a table, one axis or all."""
    record = moving(rng)
    place = cut(rng, record)
    for axis in hit_axes(rng, record):
        record.gyro[axis][place:] *= -1.0
    return record


def wrapped(rng: np.random.Generator) -> Record:
    """Rates beyond 55 to 95 % of the highest one wrap round, as an integer of 16 bits does."""
    record = moving(rng)
    limit = max(float(np.max(np.abs(values))) for values in record.gyro.values()) * rng.uniform(0.55, 0.95)
    for axis, values in record.gyro.items():
        record.gyro[axis] = (values + limit) % (2.0 * limit) - limit
    return record


def filter_switched(rng: np.random.Generator) -> Record:
    """The low-pass of the unit changes from a row on: its noise falls to between a tenth and a third."""
    record = rest(rng)
    record.lsb *= 0.1
    place = cut(rng, record)
    ratio = rng.uniform(0.1, 0.33)
    keep = (1 - ratio**2) / (1 + ratio**2)
    for axis, values in record.gyro.items():
        smooth = filtered(values[place:], keep)
        record.gyro[axis][place:] = smooth
    return record


def range_switched(rng: np.random.Generator) -> Record:
    """From a row on the output is 2 or 4 times larger or smaller: another range, the old scale."""
    record = either(rng)
    place, factor = cut(rng, record), float(rng.choice((0.25, 0.5, 2.0, 4.0)))
    record.gyro = {
        axis: values * np.where(np.arange(record.size) < place, 1.0, factor) for axis, values in record.gyro.items()
    }
    return record


def interleaved(rng: np.random.Generator) -> Record:
    """Lines of a second unit between those of the first, with its own biases (10 to 40 standard deviations away)."""
    record = rest(rng)
    other = rng.random(record.size) < 0.5 if rng.random() < 0.5 else np.arange(record.size) % 2 == 1
    for axis, values in record.gyro.items():
        twin = output(rng, record, axis, "mems" if record.sigma[axis] > 0.002 else "fog", np.zeros(record.size))
        apart = rng.uniform(10.0, 40.0) * rng.choice((-1.0, 1.0))
        twin += apart * max(record.sigma[axis], float(np.std(np.diff(values)))) + np.mean(values) - np.mean(twin)
        record.gyro[axis] = np.where(other, rounded(twin, record.lsb), values)
    return record


def bias_jump(rng: np.random.Generator) -> Record:
    """A shock: the bias of an axis steps by 10 to 100 standard deviations and stays."""
    record = rest(rng)
    axis = some_axis(rng, record)
    size = record.sigma[axis] * log_uniform(rng, 10.0, 100.0) * rng.choice((-1.0, 1.0))
    record.gyro[axis][cut(rng, record) :] += rounded(np.full(1, size), record.lsb)
    return record


def dead_axis(rng: np.random.Generator) -> Record:
    """An axis that is not connected: one value from the first row to the last."""
    record = three_at_rest(rng) if rng.random() < 0.5 else moving(rng, ("x", "y", "z"))
    axis = some_axis(rng, record)
    record.gyro[axis][:] = float(rng.choice((0.0, 0.0, record.gyro[axis][0])))
    return record


def zeros(rng: np.random.Generator) -> Record:
    """All axes read zero for a while: 0.5 to 20 % of the rows, 20 at least; a read that failed."""
    record = either(rng)
    part = stretch(rng, record, 0.005, 0.2, least=20)
    for axis in record.gyro:
        record.gyro[axis][part] = 0.0
    return record


def noise_burst(rng: np.random.Generator) -> Record:
    """A loose plug: 2 to 20 % of the rows have 8 to 50 times the noise."""
    record = either(rng)
    axis, part = some_axis(rng, record), stretch(rng, record, 0.02, 0.2)
    noise = rng.normal(0.0, record.sigma[axis] * rng.uniform(8.0, 50.0), part.stop - part.start)
    record.gyro[axis][part] += rounded(noise, record.lsb)
    return record


def lost_point(rng: np.random.Generator) -> Record:
    """3 to 30 readings lost their decimal point: 1000 times too large."""
    record = either(rng)
    axis = some_axis(rng, record)
    rows = rng.choice(record.size, int(rng.integers(3, 31)), replace=False)
    record.gyro[axis][rows] = np.round(record.gyro[axis][rows] * 1000.0 + rng.choice((-300.0, 300.0)))
    return record


def shifted_columns(rng: np.random.Generator) -> Record:
    """A field was lost: in 1 to 40 % of the rows each gyro column holds the next one, the last the temperature."""
    record = three_at_rest(rng)
    part = stretch(rng, record, 0.01, 0.4)
    columns = [*(values.copy() for values in record.gyro.values()), record.temperature.copy()]
    for axis, values in zip(record.gyro, columns[1:], strict=True):
        record.gyro[axis][part] = values[part]
    record.temperature[part] = columns[0][part]
    return record


def stalled(rng: np.random.Generator) -> Record:
    """The table lost its steps: within data sets at 10 deg/s or more it stood for 20 to 100 % of the rows."""
    record = moving(rng)
    assert record.dataset is not None
    assert record.table_rate is not None
    for chosen in rng.choice(np.unique(record.dataset[np.abs(record.table_rate) >= 10.0]), 2, replace=False):
        rows = np.flatnonzero(record.dataset == chosen)
        rows = rows[int(len(rows) * rng.uniform(0.0, 0.8)) :]
        for axis in record.gyro:
            still = rng.normal(0.0, record.sigma[axis], len(rows))
            record.gyro[axis][rows] = rounded(still, record.lsb)
    return record


def wrong_rate(rng: np.random.Generator) -> Record:
    """The rate of one or two data sets is written with the wrong sign, or ten times too small."""
    record = moving(rng)
    assert record.dataset is not None
    assert record.table_rate is not None
    fast = np.unique(record.dataset[np.abs(record.table_rate) >= 10.0])
    for chosen in rng.choice(fast, int(rng.integers(1, 3)), replace=False):
        record.table_rate[record.dataset == chosen] *= float(rng.choice((-1.0, 0.1)))
    return record


def blank_cells(rng: np.random.Generator) -> Record:
    """0.3 to 10 % of the readings of an axis are empty."""
    record = either(rng)
    record.gyro[some_axis(rng, record)][rng.random(record.size) < log_uniform(rng, 0.003, 0.1)] = np.nan
    return record
