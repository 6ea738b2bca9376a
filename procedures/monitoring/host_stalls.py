"""Stalls of this computer: for how long the process was not run, by the computer's monotonic clock.

A thread reads the time every `PERIOD_S`; where it, or who asks, comes late, the process was not run meanwhile. What
no instrument was asked for it cannot have failed to answer: a silence counts without the stalls in it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from instruments.clock import Clock, SystemClock, pauses_in_stalls, registered
from procedures.contracts.journal import Event

PERIOD_S = 0.1
#: The time is read so often while something is timed to milliseconds, s of real time.
SHORT_PERIOD_S = 0.005
#: A shorter delay is the usual one of a scheduler, s of real time.
MIN_S = 0.1
#: A stall is said from this length on, s of real time, and at most so often.
SAID_FROM_S, SAY_EVERY_S = 0.5, 60.0
#: A duration with which a clock tells how fast it runs, s.
LONG_S = 1e6
#: So many stalls are remembered, the newest: a data set is not longer.
REMEMBERED = 1000


@dataclass(frozen=True)
class Stall:
    """One stall, in seconds of the bench's clock. When in its interval the process was not run is not known."""

    from_s: float
    until_s: float
    length_s: float  #: shorter than the interval by the period in which the time is read

    def overlap_s(self, from_s: float, until_s: float) -> float:
        """Return for how long at most the process was not run between two times."""
        return min(max(min(self.until_s, until_s) - max(self.from_s, from_s), 0.0), self.length_s)


class HostStalls:
    """Stalls while one campaign runs. Where the clock stands still meanwhile there are none: in virtual and paced time,
    and in the time that a simulator shares with this process.

    `wall` is the real time of this computer; any thread may ask.
    """

    def __init__(self, clock: Clock, wall: Clock | None = None) -> None:
        self._wall = wall or SystemClock()
        self._clock = clock
        real = clock.wall_s(2 * LONG_S) > clock.wall_s(LONG_S) and not pauses_in_stalls(clock)
        self.speed = LONG_S / clock.wall_s(LONG_S) if real else 0.0  #: clock seconds in one of real time; 0: no stalls
        self._lock = threading.Lock()
        self._looked_s: float | None = None
        self._total_s = self._longest_s = self._unsaid_s = 0.0
        self._said_s: float | None = None
        self._newest: deque[Stall] = deque(maxlen=REMEMBERED)

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Read the time while the block runs, in a thread of its own.

        A clock that stands still in stalls waits for this thread instead.
        """
        if not self.speed:
            with registered(self._clock):
                yield
            return
        ended = threading.Event()
        self._looked_s = self._wall.now_s()
        thread = threading.Thread(target=self._run, args=(ended,), name="host stalls", daemon=True)
        thread.start()
        try:
            yield
        finally:
            self._looked_s = None
            ended.set()

    @contextmanager
    def lateness(self) -> Iterator[Lateness]:
        """Measure how late this computer runs while the block runs; 0 where the clock stands still in stalls."""
        lateness, ended = Lateness(self._wall), threading.Event()
        if not self.speed:
            yield lateness
            return
        thread = threading.Thread(target=lateness.watch, args=(ended,), name="lateness", daemon=True)
        thread.start()
        try:
            yield lateness
        finally:
            ended.set()
            thread.join()

    def total_s(self) -> float:
        """Return how long the process was not run so far, s of real time."""
        with self._lock:
            self._look()
            return self._total_s

    def total_clock_s(self) -> float:
        """Return the same in seconds of the bench's clock."""
        return self.total_s() * self.speed

    def since(self, from_s: float) -> tuple[Stall, ...]:
        """Return the stalls that ended after `from_s`, a time of the bench's clock."""
        with self._lock:
            self._look()
            return tuple(stall for stall in self._newest if stall.until_s > from_s)

    def news(self, *, at_the_end: bool = False) -> Event | None:
        """Return what is to be said of stalls since it was last said; None where there is nothing, or too soon.

        At the end of a campaign nothing is too soon.
        """
        with self._lock:
            self._look()
            now_s = self._wall.now_s()
            early = not at_the_end and self._said_s is not None and now_s - self._said_s < SAY_EVERY_S
            if self._longest_s < SAID_FROM_S or early:
                return None
            longest_s, unsaid_s = self._longest_s, self._unsaid_s
            self._said_s, self._longest_s, self._unsaid_s = now_s, 0.0, 0.0
        text = not_run(longest_s)
        if unsaid_s > 1.1 * longest_s:
            text += f" at a time, {unsaid_s:.1f} s in all"
        if self.speed != 1.0:
            text += f" ({unsaid_s * self.speed:.0f} s of the bench's time)"
        advice = "readings are counted against those expected; end other work on this computer"
        return Event("host_stalled", f"{text}; {advice}", level="warning", value=unsaid_s, unit="s")

    def _run(self, ended: threading.Event) -> None:
        while not ended.wait(PERIOD_S):
            self.total_s()

    def _look(self) -> None:
        """Take in the time since it was read last; holds the lock."""
        if self._looked_s is None:
            return
        now_s = self._wall.now_s()
        late_s, self._looked_s = now_s - self._looked_s - PERIOD_S, now_s
        if late_s >= MIN_S:
            self._total_s += late_s
            self._unsaid_s += late_s
            self._longest_s = max(self._longest_s, late_s)
            until_s = self._clock.now_s()
            from_s = until_s - self.speed * (late_s + PERIOD_S)
            self._newest.append(Stall(from_s, until_s, self.speed * late_s))


class Lateness:
    """How late this computer runs a thread, down to milliseconds: what is timed meanwhile may be timed as late.

    `wall` is the real time of this computer.
    """

    def __init__(self, wall: Clock) -> None:
        self._wall = wall
        self._looked_s: float | None = None
        self.largest_s = 0.0  #: s of real time

    def look(self) -> None:
        """Take in the time since it was read last, which was to be `SHORT_PERIOD_S`."""
        now_s = self._wall.now_s()
        if self._looked_s is not None:
            self.largest_s = max(self.largest_s, now_s - self._looked_s - SHORT_PERIOD_S)
        self._looked_s = now_s

    def watch(self, ended: threading.Event) -> None:
        """Read the time every `SHORT_PERIOD_S` until the end."""
        self.look()
        while not ended.wait(SHORT_PERIOD_S):
            self.look()
        self.look()


def not_run(stalled_s: float) -> str:
    """Return what a person reads of a stall of so many seconds of real time."""
    return f"this computer did not run labctl for {stalled_s:.1f} s"
