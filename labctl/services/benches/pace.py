"""Whether the simulated time of a campaign keeps the speed that was asked for: figures, and a warning in the log."""

from __future__ import annotations

import math
from collections.abc import Callable

from instruments.clock import Clock, PacedClock, SystemClock
from labctl.log import get_logger
from procedures.monitoring.progress import Observer, Progress

log = get_logger()

#: A clock is slow below this share of the asked speed, for so long, s of real time: then the speed that the clock tells
#: is that of the slow time alone.
SLOW_SHARE, SLOW_FOR_S = 0.9, PacedClock.WINDOW_S
#: Another speed is logged again once it differs by this factor.
CHANGED = 1.5
#: From one comparison of the speeds to the next, s of real time.
POLL_INTERVAL_S = 1.0


def asked_speed(clock: Clock) -> float | None:
    """Return the speed of simulated time that was asked for; None for real time, and for as fast as possible."""
    return clock.speed if isinstance(clock, PacedClock) and clock.speed < math.inf else None


def reached_speed(clock: Clock) -> float | None:
    """Return the speed that simulated time reaches, to 4 figures; None for real time, and before it is known."""
    speed = clock.reached_speed if isinstance(clock, PacedClock) else None
    return None if speed is None else float(f"{speed:.4g}")


class PaceWatch:
    """Logs `clock.slow` once the simulated time stays behind its speed, and again when that changes much."""

    def __init__(self, clock: Clock, wall: Clock | None = None) -> None:
        self._clock, self._wall = clock, wall or SystemClock()
        self._asked = asked_speed(clock)
        self._looked_s = -math.inf
        self._news_since_s: float | None = None  #: since when the speed is slow, and another than was logged
        self._logged: float | None = None  #: the speed that was logged last

    def look(self) -> None:
        """Compare the speeds, at most every `POLL_INTERVAL_S`."""
        now_s = self._wall.now_s()
        if self._asked is None or now_s - self._looked_s < POLL_INTERVAL_S:
            return
        self._looked_s = now_s
        reached = reached_speed(self._clock)
        if reached is None or reached >= SLOW_SHARE * self._asked or not self._is_news(reached):
            self._news_since_s = None
            return
        if self._news_since_s is None:
            self._news_since_s = now_s
        if now_s - self._news_since_s >= SLOW_FOR_S:
            self._logged, self._news_since_s = reached, None
            log.warning("clock.slow", asked=self._asked, reached=reached)

    def _is_news(self, reached: float) -> bool:
        return self._logged is None or not self._logged / CHANGED <= reached <= self._logged * CHANGED


def with_pace_watch(clock: Clock, observe: Callable[[Progress], None] | None) -> Observer | None:
    """Return an observer of a campaign that compares the speeds of its clock, too; the same where there is no speed."""
    if asked_speed(clock) is None:
        return observe
    watch = PaceWatch(clock)

    def seen(progress: Progress) -> None:
        watch.look()
        if observe is not None:
            observe(progress)

    return seen
