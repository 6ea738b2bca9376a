"""Clock times of the readings of a stream: spaced by the period of the device, anchored to the clock."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from instruments.errors import WrongInstrument
from instruments.interfaces.self_checks import StreamPeriod
from instruments.transport.stream_period import COVERAGE, TOLERANCE, UNKNOWN, PeriodLine

#: Share of the distance to the clock that each read makes up: small, so that the times do not take on wire jitter.
FOLLOW = 0.02
#: A stream further behind than this many periods is late, or has lost readings that its counter does not show.
LOST_PERIODS = 12.0
#: Readings are lost only where the stream has stayed so far behind for so long, s: bytes that were held back come at
#: last, and a stream that has caught up has lost nothing.
LATE_FOR_S = 0.9
#: Polling interval for one fresh reading, in periods: a short one keeps the reading's age below a fraction of a period.
FRESH_PERIODS = 0.125
#: After this many readings the period is known roughly, from the time that they took.
ENOUGH = 20
#: After readings were dropped the known phase is kept, unless the next reading is off by more than this many periods.
SAME_PHASE = 0.25


class StreamTime:
    """Times of a stream of evenly spaced readings, strictly rising.

    `period_s` is the nominal period, s; the device's own is estimated from the arrivals of its readings, and may differ
    by the share `tolerance`. `now_s` is when the port was emptied before the first of them.
    """

    def __init__(self, period_s: float, now_s: float, tolerance: float = TOLERANCE) -> None:
        self._line = PeriodLine(period_s, tolerance)
        self._anchor_s = now_s
        self._index = -1
        self._started = False
        self._dropped = False
        self._last_s = -np.inf
        self._last_now_s = now_s
        self._late_since_s: float | None = None
        self._least_behind = 0.0  # since then, in periods

    @property
    def is_late(self) -> bool:
        """Whether the stream is too far behind the Clock, and it is still open whether readings are lost."""
        return self._late_since_s is not None

    @property
    def line(self) -> PeriodLine:
        """What is known of the period."""
        return self._line

    @property
    def known(self) -> StreamPeriod:
        """What is known of the period, with its standard uncertainty."""
        line = self._line
        return StreamPeriod(line.nominal_s, line.measured_s, line.u_share / COVERAGE)

    def drop(self) -> None:
        """Expect any number of missing readings before the next ones, which must be passed on as soon as they come.

        The device continues at its own even spacing, so its known phase is kept: times do not jump when
        reading resumes.
        """
        self._dropped, self._late_since_s = True, None

    def times(
        self,
        advance: NDArray[np.int64],
        now_s: float,
        wrap: int = 0,
        *,
        newest_s: float | None = None,
        width_s: float | None = None,
    ) -> tuple[NDArray[np.float64], int]:
        """Return the clock times (n,) of readings that follow each other by `advance` (n,) periods, and the losses.

        The newest cannot be later than now; where it is known better, it arrived within the `width_s` seconds before
        `newest_s`. `wrap` is how many lost readings leave a device's counter as it was; where the stream stays behind
        the Clock by whole wraps, they are counted as lost (0: any number of readings). Until that is decided the
        readings follow each other as the counter says.
        """
        index = self._index + np.cumsum(advance)
        if self._dropped and self._started:
            index += self._resumed(now_s) - index[-1]
        self._dropped = False
        if self._started:
            lost = self._lost(int(index[-1]), now_s, wrap)
        else:
            lost = 0
            self._begin(int(index[-1]), now_s)
        index = index + lost
        if self.is_late:  # these arrivals say nothing of the period or the phase
            return self._late_times(index, now_s), 0
        period_s = self._period_with(int(index[-1]), now_s if newest_s is None else newest_s, width_s)
        if newest_s is not None and self._line.is_followed:
            now_s = newest_s
        behind_s = now_s - (self._anchor_s + int(index[-1]) * period_s)
        self._anchor_s += behind_s if behind_s < 0 else FOLLOW * max(behind_s - period_s, 0.0)
        times = self._anchor_s + index * period_s
        if times[0] - self._last_s < 0.5 * period_s:
            # The device is ahead of the Clock and was just held back: its readings share the time since the last one.
            share = (index - self._index) / (index[-1] - self._index)
            times = self._last_s + share * (max(float(times[-1]), now_s) - self._last_s)
        self._index, self._last_s, self._last_now_s = int(index[-1]), float(times[-1]), now_s
        return np.asarray(times, dtype=np.float64), lost

    def _begin(self, newest: int, now_s: float) -> None:
        """Anchor the times at the newest of the first readings."""
        period_s, took_s = self._line.period_s, now_s - self._last_now_s
        if newest >= ENOUGH and UNKNOWN < took_s / (newest * period_s) < 1 / UNKNOWN:
            # the reading before the first came within a period of the emptying of the port
            self._line.add(-1, self._last_now_s + period_s, 2 * period_s)
        self._anchor_s, self._index, self._started = now_s - newest * period_s, newest, True

    def _lost(self, newest: int, now_s: float, wrap: int) -> int:
        """Return how many readings are missing that no counter shows: the stream is too far behind the Clock."""
        period_s = self._line.period_s
        behind = (now_s - self._anchor_s) / period_s - newest
        # while the period is hardly known, a slow device falls behind without any loss
        slow = self._line.u_share * (now_s - self._last_now_s) / period_s
        if behind <= LOST_PERIODS + slow:
            self._late_since_s = None
            return 0
        if self._late_since_s is None:
            self._late_since_s, self._least_behind = now_s, behind
            return 0
        self._least_behind = min(self._least_behind, behind)
        if now_s - self._late_since_s < LATE_FOR_S:
            return 0
        self._late_since_s = None
        unit = wrap or 1
        lost = unit * round(self._least_behind / unit)
        if lost:
            self._line.restart()
        return lost

    def _late_times(self, index: NDArray[np.int64], now_s: float) -> NDArray[np.float64]:
        """Return the times (n,) of readings that may have been held back: at their period after the last one."""
        times = self._last_s + (index - self._index) * self._line.period_s
        self._index, self._last_s, self._last_now_s = int(index[-1]), float(times[-1]), now_s
        return np.asarray(times, dtype=np.float64)

    def _period_with(self, newest: int, t_s: float, width_s: float | None) -> float:
        """Return the period after one more arrival; the time of the last reading does not change with it."""
        before_s = self._line.period_s
        self._line.add(newest, t_s, before_s if width_s is None else width_s)
        period_s = self._line.period_s
        if period_s != before_s:
            self._anchor_s += self._index * (before_s - period_s)
        return period_s

    def _resumed(self, now_s: float) -> int:
        """Return the index of a reading that has just come."""
        period_s = self._line.period_s
        newest = max(round((now_s - self._anchor_s) / period_s), self._index + 1)
        behind_s = now_s - (self._anchor_s + newest * period_s)
        off_phase = abs(behind_s) > SAME_PHASE * period_s
        if off_phase:
            self._anchor_s += behind_s
        if off_phase or (newest - self._index) * self._line.u_share > SAME_PHASE:
            self._line.restart()  # the number of this reading is not known
        return newest


def refuse_other_rate(device: str, port: str | None, line: PeriodLine) -> None:
    """Raise WrongInstrument for a stream that is faster or slower than its bench file says, beyond the tolerance."""
    if line.is_outside_tolerance and (period_s := line.measured_s):
        raise WrongInstrument(
            device,
            f"sends {1 / period_s:.4g} readings/s on {port}, but the bench file says {1 / line.nominal_s:.4g}, limit "
            f"+-{100 * line.tolerance:g} %; set sample_rate_hz = {1 / period_s:.4g} or configure the unit",
        )
