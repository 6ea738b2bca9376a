"""What the processes of a service see of their supervisor: whether it stands still, and what it was asked meanwhile.

A process that was stopped (SIGSTOP, a debugger, a frozen cgroup) hears no signal: a request to end waits in the kernel
until it goes on. The other processes see that request there, and carry it out in its place. A request that came with
the stop waits no more: the kernel has entered its handler, which blocks the signal, before the process stood still.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from labctl.log import get_logger
from labctl.stop.places import ProcessId
from procedures.execution.signals import ENDING

log = get_logger()

LOOK_S = 0.5


def is_stopped(pid: int) -> bool:
    """Return whether a process stands still because a signal or a debugger has stopped it."""
    return ProcessId.of(pid).stands_still


def unheard_end(pid: int) -> bool:
    """Return whether a process that stands still was asked to end by a signal that it could not hear yet."""
    if not is_stopped(pid):
        return False
    status, asked = _status(pid), 0
    for waiting_or_in_handler in ("ShdPnd", "SigPnd", "SigBlk"):  # the supervisor itself blocks none of these signals
        asked |= int(status.get(waiting_or_in_handler, "0"), 16)
    return any(asked & (1 << (number - 1)) for number in ENDING)


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
        while not self._over.wait(LOOK_S):
            if unheard_end(self._pid):
                log.error("supervisor.stands_still", supervisor_pid=self._pid, asked_to_end=True)
                self._end()
                return


def _status(pid: int) -> dict[str, str]:
    """Return the fields of /proc/<pid>/status; none for a process that is gone."""
    with suppress(OSError):
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8", errors="replace").splitlines()
        return {name: value.strip() for name, _, value in (line.partition(":") for line in lines)}
    return {}
