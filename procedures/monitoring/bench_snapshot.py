"""What is known of the bench at one moment; the guards check it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from instruments.interfaces.gyro import Gyro, Readings


@dataclass(frozen=True)
class Gap:
    """Readings that are lost or damaged between two times of the bench's clock."""

    from_s: float
    until_s: float
    readings: int


@dataclass
class ReadingCounts:
    """How the readings of one unit in one data set came in."""

    expected: float  #: by the unit's sample rate and the length of the gate
    valid: int = 0
    invalid: int = 0  #: marked bad by the instrument itself
    damaged: int = 0  #: lost, or not of the protocol
    first_s: float = math.inf  #: clock time of the first reading in the data set
    newest_s: float = -math.inf  #: clock time of the newest reading, also after the data set
    gaps: list[Gap] = field(default_factory=list)  #: where the damaged ones are missing

    def note(self, t_s: NDArray[np.float64], from_s: float) -> None:
        """Note the clock times (n,) of readings of which those from `from_s` on may be of the data set."""
        if len(t_s):
            self.newest_s = max(self.newest_s, float(t_s[-1]))
            if (inside := t_s[t_s >= from_s]).size:
                self.first_s = min(self.first_s, float(inside[0]))

    def locate(self, t_s: NDArray[np.float64], from_s: float, missing: int, period_s: float) -> None:
        """Note where `missing` readings are, of a block at clock times (n,), n >= 1, that follows `from_s`.

        Call it before `note`. What no gap of the times shows is somewhere between the block before and its end.
        """
        before_s = max(self.newest_s, from_s)
        edges_s = np.concatenate(([min(before_s, float(t_s[0]))], t_s))
        absent = np.rint(np.diff(edges_s) / period_s).astype(int) - 1
        for k in np.argsort(-absent, kind="stable"):
            if missing <= 0 or absent[k] < 1:
                break
            readings = min(int(absent[k]), missing)
            self.gaps.append(Gap(float(edges_s[k]), float(edges_s[k + 1]), readings))
            missing -= readings
        if missing > 0:
            self.gaps.append(Gap(float(edges_s[0]), float(t_s[-1]), missing))

    def add(self, readings: Readings) -> None:
        """Count one block."""
        valid = int(readings.valid.sum())
        self.valid += valid
        self.invalid += len(readings) - valid
        self.damaged += readings.lost + readings.damaged

    @property
    def base(self) -> float:
        """What fractions refer to: all readings of the data set, also those still to come."""
        return max(self.expected, self.valid + self.invalid + self.damaged)


@dataclass(frozen=True)
class BenchSnapshot:
    """The bench at one moment."""

    t_s: float  #: campaign time
    chamber_c: float | None  #: absent without a chamber
    setpoint_c: float | None  #: as labctl gave it
    alarms: tuple[str, ...] = ()
    foreign: tuple[str, ...] = ()  #: what others have changed at the chamber, in words
    attended: bool = False  #: a person was asked to do something at the bench
    gyro_c: Mapping[str, float] = field(default_factory=dict)  #: by the units' own thermometers
    silent_s: Mapping[str, float] = field(default_factory=dict)  #: device -> time since its last answer
    taking_readings: bool = False  #: the air is meant to be at its set point, unless it moves
    air_moves: bool = False  #: the air is meant to be on its way to its set point
    asked_dps: float = 0.0
    rate_dps: float = 0.0
    counts: Mapping[str, ReadingCounts] = field(default_factory=dict)


def gyro_temperature_c(gyro: Gyro, readings: Readings) -> float | None:
    """Return what the unit's own thermometers say, averaged; None for a unit without one or without readings."""
    channels = [channel for channel in gyro.channels if channel.name.startswith("temperature")]
    if not channels or not len(readings):
        return None
    means_c = [channel.offset + channel.scale * float(readings.raw[channel.name].mean()) for channel in channels]
    return sum(means_c) / len(means_c)
