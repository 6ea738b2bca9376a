"""The clock of a bench: no other module of the runtime reads the time or sleeps.

Durations are seconds of the clock's own monotonic time, which starts at 0; records carry aware UTC. In virtual time a
sleep advances the clock at once, so a 45-hour campaign takes the time of its arithmetic; in paced time (simulators in
this process) a sleep advances it too, but at most `speed` times as fast as real time; in scaled time (simulators in
another process) one second of real time is `speed` clock seconds, but none that this computer did not run a thread on
which the bench depends (`instruments/shared_clock.py`).
"""

from __future__ import annotations

import math
import threading
import time
from bisect import insort
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from datetime import UTC, datetime, timedelta
from typing import Protocol, runtime_checkable

#: A thread that is registered with a clock reads it this often, s of real time, unless the clock says more often.
HEARTBEAT_INTERVAL_S = 0.004


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


@runtime_checkable
class PausingClock(Protocol):
    """A clock that may stand still while threads on which the bench depends are late."""

    @property
    def pauses_in_stalls(self) -> bool:
        """Whether it does."""
        ...

    @property
    def heartbeat_interval_s(self) -> float:
        """How often a registered thread reads the clock, s of real time."""
        ...

    @property
    def latency_s(self) -> float:
        """Clock time that bytes may take from one process to the other while no thread counts as late."""
        ...

    def registered(self) -> AbstractContextManager[Callable[[], None]]:
        """Make the clock wait for this thread, which calls its heartbeat at least every `HEARTBEAT_INTERVAL_S`."""
        ...


def pauses_in_stalls(clock: Clock) -> bool:
    """Return whether a clock of real or scaled time stands still while this computer does not run the bench."""
    return isinstance(clock, PausingClock) and clock.pauses_in_stalls


def latency_s(clock: Clock) -> float:
    """Return how long bytes may be on their way because threads of a shared clock take turns, s of the clock."""
    return clock.latency_s if isinstance(clock, PausingClock) else 0.0


def heartbeat_interval_s(clock: Clock) -> float:
    """Return how often a thread that is registered with a clock reads it, s of real time."""
    return clock.heartbeat_interval_s if isinstance(clock, PausingClock) else HEARTBEAT_INTERVAL_S


def wait_s(clock: Clock, timeout_s: float) -> float:
    """Return for how long a library may wait without reading the clock, s of real time.

    Where the clock waits for this thread that is less than the time-out of `timeout_s` clock seconds: ask again until
    `Deadline.is_over`.
    """
    return heartbeat_interval_s(clock) if pauses_in_stalls(clock) else clock.wall_s(timeout_s)


def processor_s() -> float:
    """Return the processor time that this thread has taken so far, s."""
    return time.thread_time()


def sleep_until(clock: Clock, t_s: float) -> None:
    """Wait until the clock reads `t_s`; returns at once when it is already later."""
    clock.sleep(t_s - clock.now_s())


class Deadline:
    """The end of a time-out of `timeout_s` clock seconds, which begins now and which a library counts in real time."""

    def __init__(self, clock: Clock, timeout_s: float) -> None:
        self._clock = clock
        self._end_s = clock.now_s() + timeout_s

    @property
    def is_over(self) -> bool:
        """Whether the time-out, over in real time, is over by the clock too, which may have stood still meanwhile."""
        return not pauses_in_stalls(self._clock) or self._clock.now_s() >= self._end_s


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

    #: Whether the clock stands still while this computer does not run a thread that is registered with it.
    pauses_in_stalls = False
    #: Clock time that bytes may take from one process to the other while no thread counts as late.
    latency_s = 0.0
    #: How often a registered thread reads the clock, s of real time.
    heartbeat_interval_s = HEARTBEAT_INTERVAL_S
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

    def registered(self) -> AbstractContextManager[Callable[[], None]]:
        """Make a clock that pauses wait for this thread, which calls the heartbeat that it is given.

        At least every `HEARTBEAT_INTERVAL_S`.
        """
        return nullcontext(_nothing)


def registered(clock: Clock) -> AbstractContextManager[Callable[[], None]]:
    """Make a clock wait for this thread as `ScaledClock.registered` does; virtual time waits for every thread."""
    return clock.registered() if isinstance(clock, PausingClock) else nullcontext(_nothing)


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
    """Time that advances only by `sleep`, at once. Raises ValueError for a start without a time zone.

    `start` is the instant at which it reads 0, and `now_s` what it reads when it is made.
    """

    #: Every time-out, s of real time. A simulator in this process replies before the call returns, or never: a slow
    #: machine must not look like a slow wire.
    WALL_TIMEOUT_S = 10.0

    def __init__(self, start: datetime = VIRTUAL_START, *, now_s: float = 0.0) -> None:
        self._now_s = now_s
        self._start = _aware(start)

    def now_s(self) -> float:
        return self._now_s

    def utc(self) -> datetime:
        return self._start + timedelta(seconds=self._now_s)

    def sleep(self, duration_s: float) -> None:
        if duration_s > 0:
            self._now_s += duration_s

    def reach(self, t_s: float) -> None:
        """Advance to `t_s` exactly, which no sum of durations does; nothing happens where that is past."""
        self._now_s = max(self._now_s, t_s)

    def wall_s(self, duration_s: float) -> float:  # noqa: ARG002  virtual time-outs do not depend on their length
        return self.WALL_TIMEOUT_S


class Wall(Protocol):
    """Real time, as a paced clock needs it: to read, and to wait for a change."""

    def now_s(self) -> float:
        """Get the monotonic real time in seconds."""
        ...

    def wait(self, changed: threading.Condition, duration_s: float) -> None:
        """Wait at most `duration_s` for a change; `changed` is held by this thread, and released meanwhile."""
        ...


class RealWall:
    """The real time of this computer."""

    def now_s(self) -> float:
        return time.monotonic()

    def wait(self, changed: threading.Condition, duration_s: float) -> None:
        changed.wait(duration_s)


def _nothing() -> None:
    """Do nothing: a sleep goes on."""


class PacedClock:
    """Time that advances only by `sleep`, and at most `speed` times as fast as real time.

    For simulators in this process. Computation takes no time of this clock: where the computer is too slow for the
    speed, or the process stands still, the clock runs slower, and at most `BACKLOG_S` of real time is caught up later.
    With an infinite speed it never waits for real time, but still leaves the other threads of the process room.

    Any thread may sleep. The clock never runs past the end of a sleep before its thread has seen that end: sleeps of
    several threads overlap, and each ends exactly `duration_s` after it began. So with one thread every reading of the
    clock is that of a `VirtualClock`. A long sleep advances the clock in steps, for those who read it meanwhile.

    `start` is the instant at which the clock is made, default now. Raises ValueError for a speed that is not positive,
    and for a start without a time zone.
    """

    #: Real time by which the clock may be late and still catch up: what a busy scheduler takes, s.
    BACKLOG_S = 0.1
    #: The clock waits once it is this far ahead of real time: shorter waits cost more than they last, s.
    MIN_WAIT_S = 0.002
    #: Longest wait between two advances of a sleep, s of real time.
    STEP_S = 0.1
    #: Without another wait in so long, the threads that wait for the interpreter are given it for `GIVE_WAY_S`.
    GIVE_WAY_EVERY_S, GIVE_WAY_S = 0.002, 0.0002
    #: `reached_speed` is that of the last so many seconds of real time, and unknown during the first.
    WINDOW_S, MARK_EVERY_S, MIN_WINDOW_S = 10.0, 0.5, 1.0
    #: Every time-out, s of real time, as that of a VirtualClock.
    WALL_TIMEOUT_S = 10.0

    def __init__(self, speed: float = math.inf, *, start: datetime | None = None, wall: Wall | None = None) -> None:
        if not speed > 0:
            raise ValueError(f"the speed of a clock is {speed}; give a number above 0 (1 is real time)")
        self.speed = speed
        self._start = datetime.now(UTC) if start is None else _aware(start)
        self._wall = wall or RealWall()
        #: Called before each wait of a sleep, by the thread that sleeps; it ends the sleep by raising.
        self.before_wait: Callable[[], None] = _nothing
        self._changed = threading.Condition()
        self._now_s = 0.0  # a float is read without the lock, also by a signal handler
        self._ends_s: list[float] = []  # of the sleeps under way, rising
        wall_s = self._wall.now_s()
        self._pace = (wall_s, 0.0)  # real time, and the clock time from which the speed is counted
        self._waited_s = wall_s  # real time at which the last wait ended
        self._marks = deque([(wall_s, 0.0)])  # real time and clock time, rising

    def now_s(self) -> float:
        return self._now_s

    def utc(self) -> datetime:
        return self._start + timedelta(seconds=self._now_s)

    def sleep(self, duration_s: float) -> None:
        if not duration_s > 0:
            return
        with self._changed:
            end_s = self._now_s + duration_s
            insort(self._ends_s, end_s)
            try:
                while self._now_s < end_s:
                    self.before_wait()
                    self._advance()
            finally:
                self._ends_s.remove(end_s)
                if self._ends_s:
                    self._changed.notify_all()

    def wall_s(self, duration_s: float) -> float:  # noqa: ARG002  no time-out depends on its length, as in virtual time
        return self.WALL_TIMEOUT_S

    @property
    def reached_speed(self) -> float | None:
        """Clock seconds per second of real time in the last `WINDOW_S`; None in the first `MIN_WINDOW_S`."""
        with self._changed:
            wall_s = self._wall.now_s()
            self._forget_before(wall_s - self.WINDOW_S)
            since_s, then_s = self._marks[0]
            if wall_s - since_s < self.MIN_WINDOW_S:
                return None
            return (self._now_s - then_s) / (wall_s - since_s)

    def _advance(self) -> None:
        """Advance to the end of the first sleep, or towards it as far as real time allows, and wait; holds the lock."""
        first_s, wall_s = self._ends_s[0], self._wall.now_s()
        if first_s <= self._now_s:  # its thread has yet to wake up
            self._wait(self.STEP_S)
            return
        self._drop_backlog(wall_s)
        since_s, then_s = self._pace
        ahead_s = (first_s - then_s) / self.speed - (wall_s - since_s)
        if ahead_s >= self.MIN_WAIT_S:
            self._now_s = min(max(self._now_s, then_s + (wall_s - since_s) * self.speed), first_s)
            self._mark(wall_s)
            self._wait(min(ahead_s, self.STEP_S))
            return
        self._now_s = first_s
        self._mark(wall_s)
        if len(self._ends_s) > 1:
            self._changed.notify_all()
        if wall_s - self._waited_s >= self.GIVE_WAY_EVERY_S:
            self._wait(self.GIVE_WAY_S)

    def _wait(self, duration_s: float) -> None:
        self._wall.wait(self._changed, duration_s)
        self._waited_s = self._wall.now_s()

    def _drop_backlog(self, wall_s: float) -> None:
        """Count the speed from a later moment where the clock is later than may be caught up."""
        since_s, then_s = self._pace
        late_s = (wall_s - since_s) - (self._now_s - then_s) / self.speed
        if late_s > self.BACKLOG_S:
            self._pace = (wall_s - self.BACKLOG_S, self._now_s)

    def _mark(self, wall_s: float) -> None:
        """Note where the clock is, for the speed that it reaches."""
        if wall_s - self._marks[-1][0] >= self.MARK_EVERY_S:
            self._marks.append((wall_s, self._now_s))
            self._forget_before(wall_s - self.WINDOW_S)

    def _forget_before(self, wall_s: float) -> None:
        """Keep one mark that is older than the window, so that the window is covered whole."""
        while len(self._marks) > 1 and self._marks[1][0] <= wall_s:
            self._marks.popleft()
