"""Campaign time: seconds since the campaign began. The only place that converts clock time to it."""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock
from instruments.interfaces.gyro import Readings

TimeT = TypeVar("TimeT", float, NDArray[np.float64])


class CampaignTime:
    """Converts readings of the clock, in monotonic seconds, to campaign time, in seconds.

    `elapsed_s` is the campaign time at the moment of construction: of a resumed campaign the time since it began, of a
    new one None; its time 0 is then set by `begin`.
    """

    def __init__(self, clock: Clock, elapsed_s: float | None = None) -> None:
        self._clock = clock
        self._is_new = elapsed_s is None
        self._zero_s = clock.now_s() - (elapsed_s or 0.0)

    def begin(self) -> None:
        """Set time 0 of a new campaign to now; a resumed campaign keeps its own."""
        if self._is_new:
            self._zero_s = self._clock.now_s()

    def now_s(self) -> float:
        """Return the present campaign time in s."""
        return self.of(self._clock.now_s())

    def of(self, clock_s: TimeT) -> TimeT:
        """Return the campaign time in s of a clock time, or of an array of them."""
        return clock_s - self._zero_s

    def of_readings(self, readings: Readings) -> Readings:
        """Return readings with their times, and those of their arrival, in campaign time."""
        arrival_s = None if readings.arrival_s is None else self.of(readings.arrival_s)
        return replace(readings, t_s=self.of(readings.t_s), arrival_s=arrival_s)
