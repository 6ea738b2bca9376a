"""Clock times of the readings of a stream: spaced by the period of the device, never later than they arrived."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from instruments.errors import WrongInstrument
from instruments.interfaces.self_checks import StreamPeriod
from instruments.transport.arrival_envelope import least_late
from instruments.transport.stream_period import COVERAGE, SPACING_S, TOLERANCE, UNKNOWN, PeriodLine

Times = NDArray[np.float64]
Whole = NDArray[np.int64]
#: Share of the distance to the clock that each read makes up: small, so that the times do not take on wire jitter.
FOLLOW = 0.02
#: The least late of the readings of this time, s of the clock, tells how far the times are from the clock.
FLOOR_S = 5.0
#: A stream without a counter that is further behind than this many periods, and this many times as far as its arrivals
#: are known, is late, or has lost readings.
LOST_PERIODS, LOST_WIDTHS = 2.0, 2.0
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
    """Times of a stream of evenly spaced readings, strictly rising; a drop may set them back to what is then known.

    `period_s` is the nominal period, s; the device's own is estimated from the arrivals of its readings, and may differ
    by the share `tolerance`. `now_s` is when the port was emptied before the first of them.
    """

    def __init__(self, period_s: float, now_s: float, tolerance: float = TOLERANCE) -> None:
        self._line = PeriodLine(period_s, tolerance)
        self._anchor_s = now_s
        self._index = -1
        self._started = self._dropped = False
        self._is_in_phase = False  #: after the last drop the phase was known: only the number can be wrong
        self._last_s = -np.inf
        self._begun_s = self._on_time_s = now_s
        self._floor: deque[tuple[int, float]] = deque()  #: number and arrival of the least late reading of each read
        self._late_since_s: float | None = None
        self._least_behind = 0.0  #: since then, in periods
        self._undecided: list[tuple[Whole, Times]] = []  #: numbers and arrivals of the readings since then
        self.held_times: Times = np.zeros(0)  #: of the readings that were undecided before the last call, once decided

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
        return StreamPeriod(line.nominal_s, line.measured_s, line.u_share / COVERAGE, line.period_s)

    def drop(self) -> None:
        """Expect any number of missing readings before the next ones, which must be passed on as soon as they come.

        The device continues at its own even spacing, so its known phase is kept: times do not jump when
        reading resumes.
        """
        self._dropped, self._late_since_s = True, None
        self._undecided.clear()

    def times(
        self,
        advance: Whole,
        now_s: float,
        wrap: int = 0,
        *,
        newest_s: float | None = None,
        width_s: float | None = None,
        arrival_s: Times | None = None,
    ) -> tuple[Times, int]:
        """Return the clock times (n,) of readings that follow each other by `advance` (n,) periods, and the losses.

        No reading is later than it arrived: at `arrival_s` (n,) where that is known, else all at `newest_s` or now.
        Bytes that were not held back arrived within the `width_s` seconds before, by default a period. `wrap` is how
        many lost readings leave a device's counter as it was; where the stream stays behind the Clock by whole wraps,
        they are counted as lost (0: any number of readings). Until that is decided (`is_late`) the readings follow each
        other as the counter says; once it is, `held_times` (m,) are their final times, before those returned.
        """
        came_s = now_s if newest_s is None else newest_s
        arrival_s = np.full(len(advance), came_s) if arrival_s is None else arrival_s
        index = self._index + np.cumsum(advance)
        width_s = self._line.period_s if width_s is None else width_s
        if not self._started:
            self._begin(index, arrival_s)
        elif self._dropped:
            index += self._resumed(int(index[-1]), float(arrival_s[-1]))
        elif self._is_in_phase:
            index -= self._too_many(index, arrival_s)
        resumed, self._dropped = self._dropped or not self._started, False
        self._started, self._index = True, int(index[-1])
        self.held_times = np.zeros(0)
        lost = self._lost(index, arrival_s, wrap, width_s)
        if self.is_late:  # these arrivals say nothing of the period or the phase
            self._undecided.append((index, arrival_s))
            return np.asarray(self._anchor_s + index * self._line.period_s, dtype=np.float64), 0
        held = sum(len(part) for part, _ in self._undecided)
        index, arrival_s = self._decide(index, arrival_s, lost)
        fresh = slice(held, None)
        self._take_in(index[fresh], arrival_s[fresh], width_s)
        times = self._rising(index, arrival_s)
        if resumed:  # the first may have been held back: those that follow tell
            self._last_s = -np.inf
        self.held_times = times[:held]
        return times[held:], lost

    def _begin(self, index: Whole, arrival_s: Times) -> None:
        """Anchor the times at the least late of the first readings."""
        period_s, took_s = self._line.period_s, float(arrival_s[-1]) - self._begun_s
        newest = int(index[-1])
        if newest >= ENOUGH and UNKNOWN < took_s / (newest * period_s) < 1 / UNKNOWN:
            # the reading before the first came within a period of the emptying of the port
            self._line.add(-1, self._begun_s + period_s, 2 * period_s)
        self._anchor_s = float((arrival_s - index * period_s).min())
        self._on_time_s = float(arrival_s[-1])

    def _resumed(self, newest: int, came_s: float) -> int:
        """Return by how much the number of a reading that has just come is more than `newest`; it came on time or late.

        Its number may be too high by the periods that it was held back.
        """
        period_s = self._line.period_s
        passed = (came_s - self._anchor_s) / period_s
        number = int(np.floor(passed + SAME_PHASE))
        behind = passed - number
        self._is_in_phase = (number - self._index) * self._line.u_share < SAME_PHASE
        if not self._is_in_phase:
            self._line.restart()  # the number of this reading is not known
            if abs(behind) > SAME_PHASE:
                self._anchor_s += behind * period_s
        self._floor.clear()
        self._last_s, self._on_time_s = -np.inf, came_s
        return number - newest

    def _too_many(self, index: Whole, arrival_s: Times) -> int:
        """Return by how many periods a known phase gives readings numbers too high: they came before they were due."""
        period_s = self._line.period_s
        early = -float((arrival_s - self._anchor_s - index * period_s).min()) / period_s
        if early < 1.0 - SAME_PHASE:
            return 0
        self._floor.clear()
        return round(early)

    def _lost(self, index: Whole, arrival_s: Times, wrap: int, width_s: float) -> int:
        """Return how many readings are missing that no counter shows: the stream stays too far behind the Clock."""
        line, step = self._line, wrap or 1
        behind = (arrival_s - self._anchor_s) / line.period_s - index
        # while the period is hardly known, a slow device falls behind without any loss
        share = line.u_share if line.is_known else max(line.u_share, line.tolerance)
        slow = share * (arrival_s - self._on_time_s) / line.period_s
        limit = 0.5 * step if step > 1 else LOST_PERIODS + LOST_WIDTHS * width_s / line.period_s
        on_time = np.flatnonzero(behind <= limit + slow)
        if len(on_time):
            self._late_since_s, self._on_time_s = None, float(arrival_s[on_time[-1]])
            behind = behind[on_time[-1] + 1 :]
        if not len(behind):
            return 0
        least = float(behind.min())
        self._least_behind = least if self._late_since_s is None else min(self._least_behind, least)
        if self._late_since_s is None:
            self._late_since_s = float(arrival_s[-len(behind)])
        if arrival_s[-1] - self._late_since_s < LATE_FOR_S:
            return 0
        self._late_since_s, self._on_time_s = None, float(arrival_s[-1])
        usual = max(min((self._behind(*each) for each in self._floor), default=0.0), 0.0)
        return step * round((self._least_behind - usual) / step)

    def _behind(self, number: int, came_s: float) -> float:
        return (came_s - self._anchor_s) / self._line.period_s - number

    def _decide(self, index: Whole, arrival_s: Times, lost: int) -> tuple[Whole, Times]:
        """Return the numbers and arrivals of the undecided readings and these; `lost` are missing before some of them.

        Where they are missing every later reading is late by at least their periods.
        """
        if self._undecided:
            parts = [*self._undecided, (index, arrival_s)]
            index, arrival_s = np.concatenate([part[0] for part in parts]), np.concatenate([part[1] for part in parts])
            self._undecided.clear()
        if lost:
            behind = (arrival_s - self._anchor_s) / self._line.period_s - index
            least_from = np.minimum.accumulate(behind[::-1])[::-1]
            index = np.where(least_from > lost - 1.0, index + lost, index)
            self._index = int(index[-1])
            self._floor.clear()
            self._line.restart()
        return index, arrival_s

    def _take_in(self, index: Whole, arrival_s: Times, width_s: float) -> None:
        """Follow the period and the phase of readings that have just come."""
        line, before_s = self._line, self._line.period_s
        lateness_s = arrival_s - index * before_s
        for k in least_late(index, lateness_s, arrival_s, max(round(SPACING_S / before_s), 1)):
            line.add(int(index[k]), float(arrival_s[k]), width_s)
        period_s = line.period_s
        self._anchor_s += int(index[0] - 1) * (before_s - period_s)
        if line.u_share >= UNKNOWN:
            self._floor.clear()  # what a reading before tells of these is as uncertain as the period
        k = int((arrival_s - index * period_s).argmin())
        self._floor.append((int(index[k]), float(arrival_s[k])))
        while self._floor[0][1] < arrival_s[-1] - FLOOR_S and len(self._floor) > 1:
            self._floor.popleft()
        behind = min(self._behind(*each) for each in self._floor)
        if behind < 0.0:
            self._anchor_s += behind * period_s
        elif behind > 1.0:
            self._anchor_s += (FOLLOW * (behind - 1.0) if line.is_known else behind) * period_s

    def _rising(self, index: Whole, arrival_s: Times) -> Times:
        """Return the times (n,) of readings, after those before, and none after its arrival."""
        period_s = self._line.period_s
        self._anchor_s += min(float((arrival_s - self._anchor_s - index * period_s).min()), 0.0)
        times = self._anchor_s + index * period_s
        if times[0] - self._last_s < 0.5 * period_s:
            # The device is ahead of the times before: its readings share what is left until the next that is not.
            ahead = max(int(np.searchsorted(times, self._last_s + 0.5 * period_s)), 1)
            until_s = np.append(times[ahead : ahead + 1], arrival_s[:ahead]).min()
            share = np.arange(1, ahead + 1) / (ahead + 1)
            times[:ahead] = self._last_s + share * max(float(until_s) - self._last_s, 1e-9 * ahead)
        self._last_s = float(times[-1])
        return np.asarray(times, dtype=np.float64)


def refuse_other_rate(device: str, port: str | None, line: PeriodLine, rates_hz: Sequence[float] = ()) -> None:
    """Raise WrongInstrument for a stream that is faster or slower than its bench file says, beyond the tolerance.

    `rates_hz` are those that the device can be set to, where these are few: what is advised is possible.
    """
    if not line.is_outside_tolerance or not (period_s := line.measured_s):
        return
    rate_hz = 1 / period_s
    advice = f"set sample_rate_hz = {rate_hz:.4g} or configure the unit"
    if rates_hz:
        nearest_hz = min(rates_hz, key=lambda each: abs(each - rate_hz))
        if abs(rate_hz / nearest_hz - 1.0) <= line.tolerance:
            advice = f"set sample_rate_hz = {nearest_hz:g} or configure the unit"
        else:
            able = ", ".join(f"{each:g}" for each in rates_hz)
            advice = (
                f"by its own crystal the unit sends {able} readings/s and no other; check whether something triggers "
                "it, and the clock of this computer; if both are in order, have the unit repaired"
            )
    raise WrongInstrument(
        device,
        f"sends {rate_hz:.4g} readings/s on {port}, but the bench file says {1 / line.nominal_s:.4g}, limit "
        f"+-{100 * line.tolerance:g} %; {advice}",
    )
