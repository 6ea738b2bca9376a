"""A clock whose sleep ends with a stop: what waits inside a driver, for a ramp or a homing, does not delay it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from datetime import datetime
from functools import partial

from instruments.clock import Clock, PacedClock, ScaledClock
from procedures.contracts.control import Control
from procedures.contracts.errors import Aborted, Interrupted

#: How long the bench's thread sleeps at most before it looks for a stop, s of real time.
POLL_INTERVAL_S = 0.1


class StoppableClock:
    """The clock of one campaign on a bench that runs in real or scaled time.

    `sleep` raises Aborted or Interrupted in the thread that drives the bench, as a Ctrl-C raises KeyboardInterrupt
    there; not once the bench is being made safe, and in no other thread.
    """

    def __init__(self, clock: ScaledClock, control: Control) -> None:
        self._clock, self._control = clock, control
        self._slice_s = POLL_INTERVAL_S * clock.speed

    def now_s(self) -> float:
        return self._clock.now_s()

    def utc(self) -> datetime:
        return self._clock.utc()

    def wall_s(self, duration_s: float) -> float:
        return self._clock.wall_s(duration_s)

    @property
    def pauses_in_stalls(self) -> bool:
        """Whether the clock stands still while a registered thread is late."""
        return self._clock.pauses_in_stalls

    @property
    def heartbeat_interval_s(self) -> float:
        """How often a registered thread reads the clock, s of real time."""
        return self._clock.heartbeat_interval_s

    @property
    def latency_s(self) -> float:
        """Clock time that bytes may take from one process to the other."""
        return self._clock.latency_s

    def registered(self) -> AbstractContextManager[Callable[[], None]]:
        """Make the clock wait for this thread, as the clock itself does."""
        return self._clock.registered()

    def sleep(self, duration_s: float) -> None:
        until_s = self._clock.now_s() + duration_s
        self._look()
        while (left_s := until_s - self._clock.now_s()) > 0:
            self._clock.sleep(min(self._slice_s, left_s))
            self._look()

    def _look(self) -> None:
        end_here(self._control)


def end_here(control: Control) -> None:
    """Raise Aborted or Interrupted in the thread that drives the bench, once its end was asked for."""
    if (request := control.ends_here()) is not None:
        raise Interrupted(request.reason) if request.resumable else Aborted(request.reason)


def stoppable(clock: Clock, control: Control) -> Clock:
    """Return a clock whose sleep ends with a stop; purely virtual time, in which no sleep lasts, as it is."""
    if isinstance(clock, PacedClock):  # it waits in steps of its own, which leave its readings as they are
        clock.before_wait = partial(end_here, control)
        return clock
    return StoppableClock(clock, control) if isinstance(clock, ScaledClock) else clock
