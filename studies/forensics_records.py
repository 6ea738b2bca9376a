"""Records of readings with one fault each, and clean ones, made with numpy alone.

The sizes are those at which a fault does harm; they were written down before the checks that look for them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AXES = ("x", "y", "z")
RAD = np.pi / 180


@dataclass(frozen=True)
class Record:
    """n readings of a unit: outputs (n, 3) in deg/s, one thermometer, and what the table did.

    `motion` is "rest", "rates" (one rate in each data set) or "profile" (the rate of each reading is known).
    """

    motion: str
    t_s: Array
    dataset: NDArray[np.int64]
    table_rate_dps: Array
    gyro_dps: Array
    temperature_c: Array
    noise_dps: float  #: of one reading
    step_s: float
    axis: str  #: along the axis of the table

    def __len__(self) -> int:
        return len(self.t_s)

    def rows(self, kept: NDArray[np.bool_] | NDArray[np.int64]) -> Record:
        """Return the record with some of its rows, or with some repeated."""
        names = ("t_s", "dataset", "table_rate_dps", "gyro_dps", "temperature_c")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})


def clean(rng: np.random.Generator) -> Record:
    """Return a record without a fault: at rest, on a table or along a profile; MEMS or fibre-optic; jitter or none."""
    motion = str(rng.choice(["rest", "rest", "rates", "profile"]))
    rate_hz = float(rng.choice([10.0, 25.0, 50.0, 100.0, 200.0]))
    t_s, dataset, rate = _schedule(rng, motion, rate_hz)
    n = len(t_s)
    mems = rng.random() < 0.6
    noise = float(rng.uniform(0.02, 0.2) if mems else rng.uniform(0.002, 0.02))
    temperature = _temperature(rng, t_s)
    axis = int(rng.integers(3))
    gain = rng.normal(0.0, 0.02, 3)
    gain[axis] = rng.uniform(0.97, 1.03)
    bias = rng.normal(0.0, 0.8 if mems else 0.01, 3)
    per_k = rng.normal(0.0, 0.02 if mems else 0.0005, 3)
    gyro = bias + np.outer(rate, gain) + np.outer(temperature - 25.0, per_k)
    gyro = gyro + noise * rng.normal(size=(n, 3)) + _wander(rng, n, rate_hz) * noise * 0.2
    gyro = _steps(gyro, noise * float(rng.choice([0.0, 0.05, 0.5])))  # a converter that is fine enough
    jitter = float(rng.choice([0.0, 0.02, 0.2]))
    t_s = t_s + jitter / rate_hz * rng.uniform(-0.5, 0.5, n)
    t_s -= t_s[0]
    return Record(motion, t_s, dataset, rate, gyro, temperature, noise, 1.0 / rate_hz, AXES[axis])


def _schedule(rng: np.random.Generator, motion: str, rate_hz: float) -> tuple[Array, NDArray[np.int64], Array]:
    if motion == "rest":
        n = int(rng.integers(4000, 20000))
        return np.arange(n) / rate_hz, np.ones(n, dtype=np.int64), np.zeros(n)
    if motion == "profile":
        n = int(rng.integers(4000, 20000))
        t_s = np.arange(n) / rate_hz
        rate = 60.0 * np.sin(2 * np.pi * t_s / rng.uniform(20.0, 60.0)) + 20.0 * np.sin(2 * np.pi * t_s / 7.3)
        return t_s, np.ones(n, dtype=np.int64), rate
    sets, each = int(rng.integers(15, 31)), int(rng.integers(300, 700))
    fastest = float(rng.uniform(30.0, 200.0))
    rates = rng.permutation(np.linspace(-fastest, fastest, sets))
    rates[np.argmin(np.abs(rates))] = 0.0
    begins = np.cumsum(np.full(sets, each / rate_hz) + rng.uniform(5.0, 20.0, sets))
    t_s = (begins[:, None] + np.arange(each) / rate_hz).ravel()
    return t_s, np.repeat(np.arange(1, sets + 1), each), np.repeat(rates, each)


def _temperature(rng: np.random.Generator, t_s: Array) -> Array:
    """Return a thermometer's readings: still, warming up or cooling through 0 deg C, in the steps of its converter."""
    span = max(float(np.ptp(t_s)), 1.0)
    start, change = rng.uniform(-20.0, 40.0), float(rng.choice([0.0, 1.0, 15.0, -30.0]))
    true = start + change * (1 - np.exp(-3.0 * (t_s - t_s[0]) / span))
    step = float(rng.choice([0.0, 0.01, 0.0625, 0.5]))
    return _steps(true + rng.normal(0.0, 0.02, len(t_s)), step)


def _wander(rng: np.random.Generator, n: int, rate_hz: float) -> Array:
    """Return first-order Markov noise of a few seconds for three outputs, (n, 3), of size 1."""
    keep = np.exp(-1.0 / (rng.uniform(2.0, 20.0) * rate_hz))
    drive = np.sqrt(1 - keep**2) * rng.normal(size=(n, 3))
    found = np.zeros((n, 3))
    for row in range(1, n):
        found[row] = keep * found[row - 1] + drive[row]
    return found


def _steps(values: Array, step: float) -> Array:
    return np.round(values / step) * step if step > 0 else values


def _stretch(rng: np.random.Generator, n: int, low: float, high: float) -> slice:
    length = max(int(rng.uniform(low, high) * n), 2)
    begin = int(rng.integers(1, n - length))
    return slice(begin, begin + length)


def _one_set(rng: np.random.Generator, record: Record) -> slice:
    rows = np.flatnonzero(record.dataset == rng.choice(np.unique(record.dataset)))
    return slice(int(rows[0]), int(rows[-1]) + 1)


def frozen(rng: np.random.Generator, record: Record) -> Record:
    """One output or all of them stay at one value: for half a record, a tenth of it, or one data set."""
    n = len(record)
    half = slice(n // 2, n)
    if record.motion == "rates":
        here = _one_set(rng, record) if rng.random() < 0.6 else half
    else:
        here = half if rng.random() < 0.4 else _stretch(rng, n, 0.05, 0.4)
    gyro = record.gyro_dps.copy()
    axes = np.arange(3) if rng.random() < 0.4 else np.array([int(rng.integers(3))])
    gyro[here.start : here.stop, axes] = gyro[here.start, axes]
    return replace(record, gyro_dps=gyro)


def clipped(rng: np.random.Generator, record: Record) -> Record:
    """An output does not go beyond a limit: a converter or an amplifier at its end, on one side or both."""
    gyro = record.gyro_dps.copy()
    axis = int(np.argmax(np.ptp(gyro, axis=0)))
    share = rng.uniform(0.01, 0.2) if record.motion != "rates" else rng.uniform(0.05, 0.2)
    top = float(np.quantile(gyro[:, axis], 1 - share))
    low = float(np.quantile(gyro[:, axis], share)) if rng.random() < 0.5 else -np.inf
    gyro[:, axis] = np.clip(gyro[:, axis], low, top)
    return replace(record, gyro_dps=gyro)


def moved_at_rest(rng: np.random.Generator, record: Record) -> Record:
    """A unit that is said to rest is turned: 3 to 60 s at 1 to 20 deg/s, with the way up and down to it."""
    n = len(record)
    length = min(max(int(rng.uniform(3.0, 60.0) / record.step_s), 20), n // 3)
    begin = int(rng.integers(1, n - length))
    ramp = np.minimum(np.arange(length), np.arange(length)[::-1]) / max(0.1 * length, 1.0)
    gyro = record.gyro_dps.copy()
    gyro[begin : begin + length, int(rng.integers(3))] += rng.uniform(1.0, 20.0) * np.minimum(ramp, 1.0)
    return replace(record, gyro_dps=gyro)


def spikes(rng: np.random.Generator, record: Record) -> Record:
    """Between 1 and 30 readings are far from those beside them: 12 to 1000 noises, to either side."""
    gyro = record.gyro_dps.copy()
    number = int(rng.integers(1, 31))
    at = rng.choice(np.arange(5, len(record) - 5), number, replace=False)
    size = record.noise_dps * 10 ** rng.uniform(np.log10(12.0), 3.0, number) * rng.choice([-1.0, 1.0], number)
    gyro[at, int(rng.integers(3))] += size
    return replace(record, gyro_dps=gyro)


def dead_thermometer(rng: np.random.Generator, record: Record) -> Record:
    """The thermometer answers -127, 85 or 0 deg C, as if it were not there: at times, or from a row on."""
    temperature = record.temperature_c + 5.0 * (np.abs(record.temperature_c) < 3.0)
    word = float(rng.choice([-127.0, 85.0, 0.0]))
    if rng.random() < 0.5:
        here: NDArray[np.bool_] = rng.random(len(record)) < rng.uniform(0.001, 0.05)
        here[int(rng.integers(len(record)))] = True
    else:
        here = np.arange(len(record)) >= int(rng.uniform(0.1, 0.95) * len(record))
    return replace(record, temperature_c=np.where(here, word, temperature))


def quantised(rng: np.random.Generator, record: Record) -> Record:
    """The outputs come in steps of 2.5 to 20 noises, as those of a logger with two digits do."""
    return replace(record, gyro_dps=_steps(record.gyro_dps, record.noise_dps * float(rng.uniform(2.5, 20.0))))


def dropped(rng: np.random.Generator, record: Record) -> Record:
    """Readings are lost in 1 to 40 places, 2 to 50 at once; the time stamps of the rest are right."""
    kept = np.ones(len(record), dtype=bool)
    for _ in range(int(rng.integers(1, 41))):
        begin = int(rng.integers(10, len(record) - 60))
        kept[begin : begin + int(rng.integers(2, 51))] = False
    return record.rows(kept)


def repeated(rng: np.random.Generator, record: Record) -> Record:
    """The logger writes the last reading again, with a new time stamp, in 1 to 20 % of the rows."""
    again = rng.random(len(record)) < rng.uniform(0.01, 0.2)
    again[0] = False
    last = np.maximum.accumulate(np.where(again, 0, np.arange(len(record))))
    return replace(record, gyro_dps=record.gyro_dps[last], temperature_c=record.temperature_c[last])


def mixed_units(rng: np.random.Generator, record: Record) -> Record:
    """The outputs are in rad/s in a part of the rows, as if two versions of a logger had written one file."""
    n = len(record)
    here = np.zeros(n, dtype=bool)
    if record.motion == "rates":
        sets = np.unique(record.dataset)
        here = np.isin(record.dataset, rng.choice(sets, int(rng.integers(1, len(sets) // 2)), replace=False))
        if not np.any(np.abs(record.table_rate_dps[here]) > 5.0):
            here = record.dataset <= int(np.median(sets))
    else:
        part = _stretch(rng, n, 0.1, 0.6)
        here[part] = True
    return replace(record, gyro_dps=np.where(here[:, None], record.gyro_dps * RAD, record.gyro_dps))


def two_devices(rng: np.random.Generator, record: Record) -> Record:
    """The rows of two units stand in one file: one after the other, or by turns."""
    n = len(record)
    size = max(record.noise_dps, 1e-3)
    other = np.roll(record.gyro_dps, n // 3, axis=0) if record.motion == "rest" else record.gyro_dps
    fresh = size * rng.uniform(0.3, 3.0) * rng.normal(size=(n, 3))
    offset = size * rng.uniform(6.0, 60.0, 3) * rng.choice([-1.0, 1.0], 3)
    theirs = other + fresh + offset
    theirs_now = np.arange(n) % 2 == 1 if rng.random() < 0.5 else np.arange(n) >= int(rng.uniform(0.15, 0.85) * n)
    return replace(record, gyro_dps=np.where(theirs_now[:, None], theirs, record.gyro_dps))


def copied(rng: np.random.Generator, record: Record) -> Record:
    """One output is a copy of another, or a copy with another scale, sign, offset and number of digits."""
    source, target = rng.permutation(3)[:2]
    scale = float(rng.choice([1.0, 1.0, -1.0, RAD, rng.uniform(0.2, 3.0)]))
    gyro = record.gyro_dps.copy()
    offset = 0.0 if rng.random() < 0.6 else float(rng.normal())
    gyro[:, target] = _steps(scale * gyro[:, source] + offset, 0.0 if rng.random() < 0.6 else 1e-4)
    return replace(record, gyro_dps=gyro)


def hum(rng: np.random.Generator, record: Record) -> Record:
    """The mains are in an output: 50 or 60 Hz, or their first harmonic, as sampled; 0.3 to 3 noises.

    Sampled at 10 Hz, say, they fall on 0 Hz, where they are a constant: such a record is made again at another rate.
    """
    while True:
        mains = float(rng.choice([50.0, 60.0])) * float(rng.choice([1.0, 2.0]))
        if not _hidden(mains, 1.0 / record.step_s):
            return _with_line(rng, record, mains * (1 + rng.normal(0.0, 2e-4)))
        record = clean(rng)


def _hidden(hz: float, rate_hz: float) -> bool:
    """Whether a line falls on 0 Hz as sampled, where no spectrum can show it."""
    return abs(hz / rate_hz - round(hz / rate_hz)) < 0.005


def vibration(rng: np.random.Generator, record: Record) -> Record:
    """A fan or a motor shakes the unit: a line at 0.02 to 0.48 of the sampling rate, 0.3 to 3 noises."""
    return _with_line(rng, record, float(rng.uniform(0.02, 0.48)) / record.step_s)


def _with_line(rng: np.random.Generator, record: Record, hz: float) -> Record:
    gyro = record.gyro_dps.copy()
    size = record.noise_dps * 10 ** rng.uniform(np.log10(0.3), np.log10(3.0))
    gyro[:, int(rng.integers(3))] += size * np.sin(2 * np.pi * hz * record.t_s + rng.uniform(0, 2 * np.pi))
    return replace(record, gyro_dps=gyro)


def time_back(rng: np.random.Generator, record: Record) -> Record:
    """Single rows, 1 to 20, stand after rows that were measured later, as two threads write them."""
    order = np.arange(len(record))
    for row in rng.choice(np.arange(10, len(record) - 10), int(rng.integers(1, 21)), replace=False):
        by = int(rng.integers(1, 5))
        order[[row, row + by]] = order[[row + by, row]]
    return record.rows(order)


def clock_step(rng: np.random.Generator, record: Record) -> Record:
    """The clock is set in the middle of the record: 1 s to 1 h back or on, while the readings go on evenly."""
    by_s = 10 ** rng.uniform(0.0, 3.556) * float(rng.choice([-1.0, 1.0]))
    within = np.flatnonzero(record.dataset[1:] == record.dataset[:-1]) + 1
    at = int(rng.choice(within[(within > 0.1 * len(record)) & (within < 0.9 * len(record))]))
    return replace(record, t_s=record.t_s + by_s * (np.arange(len(record)) >= at))


Fault = Callable[[np.random.Generator, Record], Record]
FAULTS: dict[str, Fault] = {
    fault.__name__: fault
    for fault in (
        frozen, clipped, moved_at_rest, spikes, dead_thermometer, quantised, dropped, repeated, mixed_units,
        two_devices, copied, hum, vibration, time_back, clock_step,
    )
}  # fmt: skip
ONLY_AT_REST = frozenset({"moved_at_rest"})


def faulty(kind: str, seed: int) -> Record:
    """Return a record with one fault of a kind, at a random place and of a random size."""
    rng = np.random.default_rng([seed, *kind.encode()])
    record = clean(rng)
    while kind in ONLY_AT_REST and record.motion != "rest":
        record = clean(rng)
    return FAULTS[kind](rng, record)


def clean_record(seed: int) -> Record:
    """Return a record without a fault."""
    return clean(np.random.default_rng([seed, 0]))
