"""The end of a data set: readings of its gate that are still on their way are waited for, and missing ones are counted.

The unit's rate and the length of the gate promise a number of readings. A wire, an adapter or a busy computer may hold
bytes back: the unit is read for at most `WAIT_S` after the gate. What has not come by then is lost.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from instruments.interfaces.gyro import Gyro, Readings
from instruments.interfaces.self_checks import LateTelling, StreamingGyro
from instruments.transport.stream_period import COVERAGE, TOLERANCE
from procedures.monitoring.bench_snapshot import Gap, ReadingCounts

#: Readings of a gate are waited for until this long after its end, s of the clock.
WAIT_S = 2.0
#: As long as the table is still steady after the gate, s.
STEADY_S = 0.4
#: From one read to the next meanwhile, s.
EVERY_S = 0.1
#: The first and the last reading of a gate may fall outside it.
EDGES = 2.0
#: A unit whose newest reading is further before the end of the gate than this, in periods, has more to send.
PENDING = 1.5


@dataclass(frozen=True)
class Promise:
    """How many readings of a unit a gate has, and by how much its rate is uncertain."""

    readings: float
    u_readings: float  #: expanded

    @property
    def least(self) -> float:
        """The least number with which nothing is missing."""
        return self.readings - self.u_readings - EDGES

    def missing(self, came: int) -> int:
        """Return how many readings are missing where `came` readings came, or were counted as lost; 0 for none."""
        return round(self.readings) - came if came < self.least else 0


def promise_of(gyro: Gyro, gate_s: float) -> Promise:
    """Return how many readings a unit promises in a gate of `gate_s` s.

    By the measured period of its stream where that is known; before, by the rate of the bench file.
    """
    period = gyro.period if isinstance(gyro, StreamingGyro) else None
    if period is not None and period.measured_s:
        readings = gate_s / period.measured_s
        return Promise(readings, COVERAGE * period.u_share * readings)
    readings = gate_s * gyro.sample_rate_hz
    own_clock = period is not None or isinstance(gyro, LateTelling)
    return Promise(readings, TOLERANCE * readings if own_clock else 0.0)


def _periods(gyro: Gyro, duration_s: float) -> float:
    """Return how many periods of a unit's readings a duration has."""
    period = gyro.period if isinstance(gyro, StreamingGyro) else None
    measured_s = None if period is None else period.measured_s
    return duration_s / measured_s if measured_s else duration_s * gyro.sample_rate_hz


def room(gyro: Gyro, readings: Readings, gate: tuple[float, float], count: ReadingCounts) -> int:
    """Return how many readings fall into a gate, clock time, from the newest known one to the last of these, n >= 1.

    Readings may be lost from inside a gate to beyond its end: only those of the gate are its own.
    """
    newest_s = count.newest_s if math.isfinite(count.newest_s) else float(readings.t_s[0])
    until_s = min(float(readings.t_s[-1]), gate[1])
    if newest_s >= gate[0]:
        return math.floor(_periods(gyro, max(until_s - newest_s, 0.0)) + 0.5)
    return math.floor(_periods(gyro, max(until_s - gate[0], 0.0)) + 0.5) + 1  # one may be at its very beginning


def pending(gyro: Gyro, gate: tuple[float, float], count: ReadingCounts) -> int:
    """Return how many readings of the end of a gate, clock time, have not come yet; 0 where the last one has."""
    periods = _periods(gyro, gate[1] - max(count.newest_s, gate[0]))
    return round(periods - 0.5) if periods > PENDING else 0


def dropped(gyro: Gyro, gate: tuple[float, float], count: ReadingCounts) -> int:
    """Return how many readings of the beginning of a gate are missing: dropped by a reader that came late."""
    if not math.isfinite(count.first_s):
        return 0
    periods = _periods(gyro, count.first_s - gate[0])
    return round(periods - 0.5) if periods > EDGES else 0


def gaps_at_edges(gyro: Gyro, gate: tuple[float, float], count: ReadingCounts, missing: int) -> list[Gap]:
    """Return where `missing` readings of a gate, clock time, are that no block shows: at its edges, else anywhere."""
    first = min(dropped(gyro, gate, count), missing)
    last = min(pending(gyro, gate, count), missing - first)
    edges = (
        Gap(gate[0], count.first_s, first), Gap(max(count.newest_s, gate[0]), gate[1], last),
        Gap(*gate, missing - first - last),
    )  # fmt: skip
    return [gap for gap in edges if gap.readings]


def is_late(gyro: Gyro) -> bool:
    """Return whether it is open if readings of a unit are lost or late."""
    return isinstance(gyro, LateTelling) and gyro.is_late


def lost_readings(gyro: Gyro, missing: int) -> Readings:
    """Return a block without a reading, in which `missing` readings are lost."""
    raw = {channel.name: np.zeros(0, dtype=np.int64) for channel in gyro.channels}
    return Readings(np.zeros(0), raw, np.zeros(0, dtype=bool), lost=missing)
