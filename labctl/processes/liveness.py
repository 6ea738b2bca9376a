"""Time since the last sign of life, whether the engine still moves, and how often a process was started again."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from instruments.clock import Clock, SystemClock
from labctl.errors import LabctlError

#: An engine asks for requests once a second, except in its safe state (at most 120 s) and while it waits for its
#: database (at most 45 s). One that asked for none in so long hangs, s.
ENGINE_SILENT_S = 180.0
#: Processes that end so often within a quarter of an hour are not started again.
MAX_RESTARTS, RESTARTS_WITHIN_S = 5, 900.0


class Elapsed:
    """Seconds since it was made or last restarted; any thread may read or restart it."""

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or SystemClock()
        self._since_s = self._clock.now_s()

    def restart(self) -> None:
        """Count from now on."""
        self._since_s = self._clock.now_s()

    @property
    def s(self) -> float:
        """The seconds."""
        return self._clock.now_s() - self._since_s


class Silence:
    """How long a process has said nothing; any thread may ask, or count from now on.

    A process that wanted to run and got no processor is late, not silent: that time does not count, up to `excused_s`.
    One that was stopped, or waits for something that never comes, is excused for nothing.
    """

    def __init__(self, pid: int, excused_s: float, clock: Clock | None = None) -> None:
        self._pid, self._excused_s = pid, excused_s
        self._elapsed = Elapsed(clock)
        self._delays_s = run_delays_s(pid)

    def restart(self) -> None:
        """Count from now on."""
        self._delays_s = run_delays_s(self._pid)
        self._elapsed.restart()

    @property
    def late_s(self) -> float:
        """For how long the process was kept from running since then, s: that of its thread that waited longest."""
        now_s = run_delays_s(self._pid)
        grown_s = [delay_s - self._delays_s.get(thread, 0.0) for thread, delay_s in now_s.items()]
        return min(max(grown_s, default=0.0), self._excused_s)

    @property
    def s(self) -> float:
        """The silence that the process has to answer for, s."""
        return max(self._elapsed.s - self.late_s, 0.0)


def run_delays_s(pid: int) -> dict[int, float]:
    """Return for how long each thread of a process has waited for a processor, s; nothing where that is not known.

    Linux, Documentation/scheduler/sched-stats.rst: the second field of /proc/<pid>/task/<tid>/schedstat, ns.
    """
    delays_s: dict[int, float] = {}
    with suppress(OSError, ValueError):
        for task in Path(f"/proc/{pid}/task").iterdir():
            with suppress(OSError, ValueError, IndexError):
                delays_s[int(task.name)] = 1e-9 * int((task / "schedstat").read_text(encoding="ascii").split()[1])
    return delays_s


class EngineWatch:
    """Follows how often the engine has asked for requests: `polls` returns campaign and count, None while none runs.

    A driver call that never returns leaves its process alive and its table turning.
    """

    def __init__(self, polls: Callable[[], tuple[int, int] | None], clock: Clock | None = None) -> None:
        self._polls = polls
        self._seen: tuple[int, int] | None = None
        self._since = Elapsed(clock)

    def is_stuck(self) -> bool:
        """Return whether a campaign runs whose engine has not asked for requests during `ENGINE_SILENT_S`."""
        polls = self._polls()
        if polls is None or polls != self._seen:
            self._seen = polls
            self._since.restart()
        return self._since.s > ENGINE_SILENT_S


class Restarts:
    """Counts how often something had to be started again lately."""

    def __init__(self) -> None:
        self._age = Elapsed()
        self._at_s: list[float] = []

    def one_more(self, what: str) -> None:
        """Count one. Raises LabctlError when there are too many."""
        now_s = self._age.s
        self._at_s = [at_s for at_s in self._at_s if now_s - at_s < RESTARTS_WITHIN_S] + [now_s]
        if len(self._at_s) > MAX_RESTARTS:
            raise LabctlError(
                f"{what} ended {len(self._at_s)} times within {RESTARTS_WITHIN_S / 60:g} min; labctl stops. Read the "
                "log for the cause, then start labctl again"
            )
