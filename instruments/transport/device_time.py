"""Time by a device's own clock, from the counter or the time stamps of its readings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.int64]


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
