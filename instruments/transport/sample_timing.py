"""Clock times of the readings of a stream: spaced by the period of the device, anchored to the clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Share of the distance to the clock that each read makes up: small, so that the times do not take on wire jitter.
FOLLOW = 0.02
#: A stream further behind than this many periods has lost readings that its counter does not show.
LOST_PERIODS = 12.0
#: Polling interval for one fresh reading, in periods: a short one keeps the reading's age below a fraction of a period.
FRESH_PERIODS = 0.125
#: After readings were dropped the known phase is kept, unless the next reading is off by more than this many periods.
SAME_PHASE = 0.25


class StreamTime:
    """Times of a stream of evenly spaced readings, strictly rising."""

    def __init__(self, period_s: float, now_s: float) -> None:
        self._period_s = period_s
        self._anchor_s = now_s
        self._index = -1
        self._started = False
        self._dropped = False
        self._last_s = -np.inf

    def drop(self) -> None:
        """Expect any number of missing readings before the next ones, which must be passed on as soon as they come.

        The device continues at its own even spacing, so its known phase is kept: times do not jump when
        reading resumes.
        """
        self._dropped = True

    def times(self, advance: NDArray[np.int64], now_s: float, wrap: int = 0) -> tuple[NDArray[np.float64], int]:
        """Return the clock times (n,) of readings that follow each other by `advance` (n,) periods, and the losses.

        The newest cannot be later than now. `wrap` is how many lost readings leave a device's counter as it was; where
        the stream falls behind the Clock by whole wraps, they are counted as lost (0: any number of readings).
        """
        index = self._index + np.cumsum(advance)
        if self._dropped and self._started:
            index += self._resumed(now_s) - index[-1]
        self._dropped = False
        newest = int(index[-1])
        if not self._started:
            self._anchor_s, self._started = now_s - newest * self._period_s, True
        behind_s = now_s - (self._anchor_s + newest * self._period_s)
        lost = 0
        if behind_s > LOST_PERIODS * self._period_s:
            unit = wrap or 1
            lost = unit * round(behind_s / self._period_s / unit)
            index = index + lost
            behind_s -= lost * self._period_s
        self._anchor_s += behind_s if behind_s < 0 else FOLLOW * max(behind_s - self._period_s, 0.0)
        times = self._anchor_s + index * self._period_s
        if times[0] - self._last_s < 0.5 * self._period_s:
            # The device is ahead of the Clock and was just held back: its readings share the time since the last one.
            share = (index - self._index) / (index[-1] - self._index)
            times = self._last_s + share * (max(float(times[-1]), now_s) - self._last_s)
        self._index, self._last_s = int(index[-1]), float(times[-1])
        return np.asarray(times, dtype=np.float64), lost

    def _resumed(self, now_s: float) -> int:
        """Return the index of a reading that has just come."""
        newest = max(round((now_s - self._anchor_s) / self._period_s), self._index + 1)
        behind_s = now_s - (self._anchor_s + newest * self._period_s)
        if abs(behind_s) > SAME_PHASE * self._period_s:
            self._anchor_s += behind_s
        return newest
