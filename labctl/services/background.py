"""Work that a service does beside its requests: in a thread of its own, once a second, until the service ends."""

from __future__ import annotations

import threading
from collections.abc import Callable

from instruments.clock import Clock
from labctl.acting_user import ITSELF, acting
from labctl.log import get_logger

log = get_logger()

POLL_S = 1.0


class BackgroundWork:
    """One kind of work; whatever it raises is logged when it changes, and the work is done again."""

    def __init__(self, name: str, event: str, clock: Clock, work: Callable[[], None]) -> None:
        """`name` is that of the thread, `event` that of the log's line about what keeps the work from being done."""
        self._name, self._event, self._clock, self._work = name, event, clock, work
        self._trouble = ""
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def is_over(self) -> bool:
        """Whether nothing more is to be begun."""
        return self._over.is_set()

    def start(self) -> None:
        """Do what an earlier process left, and from now on what comes."""
        self._thread = threading.Thread(target=self._watch, name=self._name, daemon=True)
        self._thread.start()

    def end_soon(self) -> None:
        """Begin nothing more; returns at once."""
        self._over.set()

    def close(self) -> None:
        """Begin nothing more; returns when the thread has ended."""
        self.end_soon()
        if self._thread is not None:
            self._thread.join()

    def note(self, error: Exception) -> None:
        """Log what keeps the work from being done, when it changes."""
        text = f"{type(error).__name__}: {error}"
        if text != self._trouble:
            log.warning(self._event, error=text)
        self._trouble = text

    def _watch(self) -> None:
        with acting(ITSELF):  # no request asked for it
            self._once()
            while not self._over.wait(self._clock.wall_s(POLL_S)):
                self._once()

    def _once(self) -> None:
        try:
            self._work()
            self._trouble = ""
        except Exception as error:  # noqa: BLE001  the thread has to survive, or nothing is done any more
            self.note(error)
