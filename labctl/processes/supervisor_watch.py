"""What the processes of a service see of their supervisor: whether it stands still, and what it was asked meanwhile.

A process that was stopped (SIGSTOP, a debugger, a frozen cgroup) hears no signal: a request to end waits in the kernel
until it goes on. The other processes see that request there, and carry it out in its place. A request that came with
the stop waits no more: the kernel has entered its handler, which blocks the signal, before the process stood still. On
a busy computer that is the handler of any thread: the kernel gives a signal to one that has none to handle yet.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from labctl.log import get_logger
from labctl.stop.places import ProcessId
from procedures.execution.signals import ENDING

log = get_logger()

POLL_INTERVAL_S = 0.5


def is_stopped(pid: int) -> bool:
    """Return whether a process stands still because a signal or a debugger has stopped it."""
    return ProcessId.of(pid).stands_still


def unheard_end(pid: int) -> bool:
    """Return whether a process that stands still was asked to end by a signal that it could not hear yet."""
    if not is_stopped(pid):
        return False
    ending, signals = sum(1 << (number - 1) for number in ENDING), 0
    for status in _statuses(pid):
        waiting, of_thread, blocked = (
            int(status.get(each, "0"), 16) & ending for each in ("ShdPnd", "SigPnd", "SigBlk")
        )
        in_handler = blocked if blocked != ending else 0  # a thread of a library may block them all, a handler its own
        signals |= waiting | of_thread | in_handler
    return bool(signals)


class SupervisorWatch:
    """Looks, in a thread of its own, whether the supervisor was asked to end and stands still."""

    def __init__(self, pid: int, end: Callable[[], None]) -> None:
        """Call `end` once, in the thread, when the process was asked to end and cannot hear it."""
        self._pid, self._end = pid, end
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, name="supervisor-watch", daemon=True)

    def start(self) -> None:
        """Look from now on."""
        self._thread.start()

    def close(self) -> None:
        """Look no more; what `end` does goes on."""
        self._over.set()

    def _look(self) -> None:
        while not self._over.wait(POLL_INTERVAL_S):
            if unheard_end(self._pid):
                log.error("supervisor.stands_still", supervisor_pid=self._pid, asked_to_end=True)
                self._end()
                return


def _statuses(pid: int) -> Iterator[dict[str, str]]:
    """Yield the fields of /proc/<pid>/task/<thread>/status of each thread; none for a process that is gone."""
    threads: list[str] = []
    with suppress(OSError):  # a process may end at any moment
        threads = os.listdir(f"/proc/{pid}/task")  # noqa: PTH208  a Path's own listing fails later
    for thread in threads:
        with suppress(OSError):
            status = Path(f"/proc/{pid}/task/{thread}/status")
            lines = status.read_text(encoding="utf-8", errors="replace").splitlines()
            yield {name: value.strip() for name, _, value in (line.partition(":") for line in lines)}
