"""The clock of a bench: no other module of the runtime reads the time or sleeps.

Durations are seconds of the clock's own monotonic time, which starts at 0; records carry aware UTC. In virtual time a
sleep advances the clock at once, so a 45-hour campaign takes the time of its arithmetic; in scaled time (demos,
simulators in another process) one second of real time is `speed` clock seconds.
"""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from typing import Protocol


class Clock(Protocol):
    """Monotonic time, UTC and sleep of one bench."""

    def now_s(self) -> float:
        """Get the monotonic time in seconds since the clock was made."""
        ...

    def utc(self) -> datetime:
        """Get the present instant as aware UTC, consistent with `now_s`."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Wait until `duration_s` seconds of this clock have passed; returns at once for zero or less."""
        ...

    def wall_s(self, duration_s: float) -> float:
        """Get the seconds of real time that a time-out of `duration_s` clock seconds may take, for client libraries."""
        ...


def sleep_until(clock: Clock, t_s: float) -> None:
    """Wait until the clock reads `t_s`; returns at once when it is already later."""
    clock.sleep(t_s - clock.now_s())


#: When virtual time begins where no other instant is stated.
VIRTUAL_START = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)


def _aware(start: datetime) -> datetime:
    """Return an instant as UTC; raises ValueError for one without a time zone."""
    if start.tzinfo is None:
        raise ValueError("the start of a clock has no time zone; give one, such as UTC")
    return start.astimezone(UTC)


class ScaledClock:
    """Wall time, `speed` times as fast; 1 for real instruments.

    `start` is the instant at which the clock of a simulation is made, default now. Raises ValueError for a speed that
    is not positive, and for a start without a time zone.
    """

    #: Least useful time-out of a client library, s of real time, at every speed.
    MIN_WALL_TIMEOUT_S = 0.05

    def __init__(self, speed: float = 1.0, *, now_s: float = 0.0, start: datetime | None = None) -> None:
        if not speed > 0:
            raise ValueError(f"the speed of a clock is {speed}; give a number above 0 (1 is real time)")
        self.speed = speed
        self._wall_start_s = time.monotonic() - now_s / speed
        self._utc_start = (datetime.now(UTC) if start is None else _aware(start)) - timedelta(seconds=now_s)

    def now_s(self) -> float:
        return (time.monotonic() - self._wall_start_s) * self.speed

    def utc(self) -> datetime:
        return self._utc_start + timedelta(seconds=self.now_s())

    def sleep(self, duration_s: float) -> None:
        if duration_s > 0:
            time.sleep(duration_s / self.speed)

    def wall_s(self, duration_s: float) -> float:
        return max(duration_s / self.speed, self.MIN_WALL_TIMEOUT_S)


class SystemClock(ScaledClock):
    """Wall time at speed 1."""

    def __init__(self) -> None:
        super().__init__(1.0)


class WallClock(SystemClock):
    """Wall time whose `utc` follows changes of the system clock: for scheduled starts, not for measurements.

    `ahead` is added to it, in a service that simulates another date.
    """

    def __init__(self, ahead: timedelta = timedelta()) -> None:
        super().__init__()
        self._ahead = ahead

    def utc(self) -> datetime:
        return datetime.now(UTC) + self._ahead


class VirtualClock:
    """Time that advances only by `sleep`, at once. Raises ValueError for a start without a time zone."""

    #: Every time-out, s of real time. A simulator in this process replies before the call returns, or never: a slow
    #: machine must not look like a slow wire.
    WALL_TIMEOUT_S = 10.0

    def __init__(self, start: datetime = VIRTUAL_START) -> None:
        self._now_s = 0.0
        self._start = _aware(start)

    def now_s(self) -> float:
        return self._now_s

    def utc(self) -> datetime:
        return self._start + timedelta(seconds=self._now_s)

    def sleep(self, duration_s: float) -> None:
        if duration_s > 0:
            self._now_s += duration_s

    def wall_s(self, duration_s: float) -> float:  # noqa: ARG002  virtual time-outs do not depend on their length
        return self.WALL_TIMEOUT_S
