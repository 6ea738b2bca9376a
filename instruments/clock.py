"""The one clock. Nothing else in the house reads the time or sleeps.

Durations are seconds of the clock's own monotonic time, which starts at 0; records carry aware UTC. In virtual time a
sleep is a jump, so a 45-hour campaign takes as long as its arithmetic; in scaled time (demos, simulators in another
process) one second of the wall is `speed` seconds of the clock.
"""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from typing import Protocol


class Clock(Protocol):
    """Time as everything in the house sees it."""

    def now_s(self) -> float:
        """Get the monotonic time in seconds since the clock was made."""
        ...

    def utc(self) -> datetime:
        """Get the present instant as aware UTC, consistent with `now_s`."""
        ...

    def sleep(self, duration_s: float) -> None:
        """Let `duration_s` seconds of this clock pass; nothing happens for zero or less."""
        ...

    def wall_s(self, duration_s: float) -> float:
        """Get how many wall seconds a time-out of `duration_s` clock seconds may take (for client libraries)."""
        ...


def sleep_until(clock: Clock, t_s: float) -> None:
    """Let the clock reach `t_s`; returns at once when it is already later."""
    clock.sleep(t_s - clock.now_s())


class ScaledClock:
    """The wall's time, run `speed` times as fast. Speed 1 is the real bench."""

    #: A client library cannot usefully wait less than this, however fast the clock runs.
    MIN_WALL_TIMEOUT_S = 0.05

    def __init__(self, speed: float = 1.0, *, now_s: float = 0.0) -> None:
        if not speed > 0:
            raise ValueError(f"clock speed must be positive, not {speed}")
        self.speed = speed
        self._wall_start_s = time.monotonic() - now_s / speed
        self._utc_start = datetime.now(UTC) - timedelta(seconds=now_s)

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
    """The wall's own time."""

    def __init__(self) -> None:
        super().__init__(1.0)


class WallClock(SystemClock):
    """The wall's own time, and `utc` follows when the wall's clock is set: for appointments, not for measuring."""

    def utc(self) -> datetime:
        return datetime.now(UTC)


class VirtualClock:
    """Time that passes only when somebody sleeps, and then at once."""

    #: An in-process simulator answers before the call returns, or never: a slow machine must not look like a slow wire.
    WALL_TIMEOUT_S = 10.0

    def __init__(self, start: datetime = datetime(2026, 1, 5, 8, 0, tzinfo=UTC)) -> None:
        if start.tzinfo is None:
            raise ValueError("a clock starts at an aware instant; give the start a time zone")
        self._now_s = 0.0
        self._start = start.astimezone(UTC)

    def now_s(self) -> float:
        return self._now_s

    def utc(self) -> datetime:
        return self._start + timedelta(seconds=self._now_s)

    def sleep(self, duration_s: float) -> None:
        if duration_s > 0:
            self._now_s += duration_s

    def wall_s(self, duration_s: float) -> float:  # noqa: ARG002  virtual time-outs do not depend on their length
        return self.WALL_TIMEOUT_S
