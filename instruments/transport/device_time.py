"""Time by a device's own clock, from counter or time stamps of its readings, or by pulses that the device is given."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.int64]
#: By how much the clock of a device may run fast or slow between two pulses, as a share.
PULSE_DRIFT = 1e-4


class DeviceClock(Protocol):
    """Makes times, in order, of what each reading says."""

    def of(self, ticks: Whole, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the device times (n,) s of readings that say `ticks` (n,) or (n, 2), at clock times `t_s` (n,)."""
        ...


class DeviceTime:
    """Time of the readings of one stream by the device's own clock, in its own seconds.

    `tick_s` is what the device calls one tick, s; its number begins again at 0 after `wrap` - 1 (None: never). The
    zero of the time is that of the device: of a counter any, of a time stamp mostly its switching-on.
    """

    def __init__(self, tick_s: float, wrap: int | None) -> None:
        self._tick_s, self._wrap = tick_s, wrap
        self._newest = 0  #: ticks, with all turns
        self._newest_s: float | None = None  #: clock time of that reading

    def of(self, ticks: Whole, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the device times (n,) s of readings whose numbers are `ticks` (n,), at clock times `t_s` (n,).

        The clock says how often the number began again since the reading before, and nothing else. After a pause that
        is right as long as the two clocks differ by less than half a turn over the pause.
        """
        if not len(ticks):
            return np.zeros(0)
        if self._wrap is None:
            return np.asarray(ticks * self._tick_s, dtype=np.float64)
        if self._newest_s is None:
            self._newest, self._newest_s = int(ticks[0]), float(t_s[0])
        moved = np.diff(ticks, prepend=self._newest % self._wrap) % self._wrap
        passed = np.diff(t_s, prepend=self._newest_s) / self._tick_s
        moved += self._wrap * np.maximum(np.rint((passed - moved) / self._wrap), 0).astype(np.int64)
        total = self._newest + np.cumsum(moved)
        self._newest, self._newest_s = int(total[-1]), float(t_s[-1])
        return np.asarray(total * self._tick_s, dtype=np.float64)


class PulseTime:
    """Time of readings that say how long ago the last pulse came, in ticks of `tick_s` s.

    Pulses are `interval_s` apart. Time is by their source; the device's own clock counts between them alone. Its zero
    is the last pulse before the first reading. The clock decides how many pulses came between two readings, so that
    pulses that are missing, of a cable that was off, do not count.
    """

    def __init__(self, tick_s: float, interval_s: float) -> None:
        self._tick_s, self._interval_s = tick_s, interval_s
        self._pulses, self._newest_s = 0, 0.0
        self._clock_s: float | None = None

    def of(self, ticks: Whole, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the device times (n,) s of readings with `ticks` (n,) since the last pulse, at clock times `t_s`."""
        if not len(ticks):
            return np.zeros(0)
        since_s = ticks * self._tick_s
        if self._clock_s is None:
            self._clock_s, self._newest_s = float(t_s[0]), float(since_s[0])
        passed_s = np.diff(t_s, prepend=self._clock_s) - np.diff(since_s, prepend=self._newest_s)
        pulses = self._pulses + np.cumsum(np.maximum(np.rint(passed_s / self._interval_s), 0.0))
        self._pulses = int(pulses[-1])
        self._newest_s, self._clock_s = float(since_s[-1]), float(t_s[-1])
        return np.asarray(pulses * self._interval_s + since_s, dtype=np.float64)


class CountedPulseTime:
    """Time of readings that say how many pulses came, and their own time; pulses are `interval_s` apart.

    A pulse came between the reading that says it first and the one before. That is known better the more pulses there
    are: the device's clock differs from their source by at most PULSE_DRIFT. Time is that of `own` until the first
    pulse; then `interval_s` from pulse to pulse, and that of `own` between them.
    """

    def __init__(self, device_time: DeviceTime, interval_s: float) -> None:
        self._own, self._interval_s = device_time, interval_s
        self._newest: tuple[float, int] | None = None  #: own time and count of the newest reading
        self._edge: tuple[float, float] | None = None  #: own times between which the last pulse came
        self._edge_s = 0.0  #: its device time

    def of(self, ticks: Whole, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the device times (n,) s of readings; `ticks` (n, 2) are their own ticks and the numbers of pulses."""
        if not len(ticks):
            return np.zeros(0)
        own_s, counts = self._own.of(ticks[:, 0], t_s), ticks[:, 1]
        before_s, before = self._newest or (float(own_s[0]), int(counts[0]))
        times_s = own_s + self._offset_s
        for k in np.flatnonzero(np.diff(counts, prepend=before)):
            self._pulse(before_s if k == 0 else float(own_s[k - 1]), float(own_s[k]))
            times_s[k:] = own_s[k:] + self._offset_s
        self._newest = float(own_s[-1]), int(counts[-1])
        return np.asarray(times_s, dtype=np.float64)

    @property
    def _offset_s(self) -> float:
        """What device time is more than own time."""
        return 0.0 if self._edge is None else self._edge_s - 0.5 * (self._edge[0] + self._edge[1])

    def _pulse(self, after_s: float, until_s: float) -> None:
        """Take in that a pulse came between two own times."""
        if self._edge is None:
            self._edge, self._edge_s = (after_s, until_s), 0.5 * (after_s + until_s)
            return
        pulses = max(round((until_s - self._edge[1]) / self._interval_s), 1)
        passed_s = pulses * self._interval_s
        low, high = self._edge[0] + passed_s * (1 - PULSE_DRIFT), self._edge[1] + passed_s * (1 + PULSE_DRIFT)
        self._edge_s += passed_s
        both = max(low, after_s), min(high, until_s)
        self._edge = both if both[0] <= both[1] else (after_s, until_s)  # another source of pulses, or a jump of it
