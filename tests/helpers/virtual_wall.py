"""Real time for a paced clock that passes only by its waits, and by what a test lets it take."""

from __future__ import annotations

import threading
from collections.abc import Callable

from instruments.clock import VirtualClock

Hook = Callable[[threading.Condition], object]


class VirtualWall:
    """Passes at once; `meanwhile` is called in each wait of a thread, by the thread's name."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.waits_s: list[float] = []
        self.meanwhile: dict[str, Hook] = {}

    def now_s(self) -> float:
        return self.clock.now_s()

    def pass_s(self, duration_s: float) -> None:
        """Let a computation, or a process that stands still, take real time."""
        self.clock.sleep(duration_s)

    def wait(self, changed: threading.Condition, duration_s: float) -> None:
        self.clock.sleep(duration_s)
        self.waits_s.append(duration_s)
        hook = self.meanwhile.get(threading.current_thread().name)
        if hook is not None:
            hook(changed)
