"""How another thread asks a running campaign to pause, go on or end. The engine looks at it at least once a second."""

from __future__ import annotations

import threading
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class ControlRequest:
    """What a person wants of the campaign at present."""

    pause: bool = False
    abort: bool = False
    taken_up: bool = False  #: after an abort: the campaign is not over, somebody takes it up
    reason: str = ""


class Control:
    """A wish that may be read and changed from any thread. Abort is final."""

    def __init__(self) -> None:
        self._lock = threading.RLock()  # a signal may come while its own thread is in here
        self._wish = ControlRequest()

    @property
    def wish(self) -> ControlRequest:
        """The present wish."""
        return self._wish

    def pause(self, reason: str = "asked by a person") -> None:
        """Ask to hold after the data set that is being taken; the environment is still recorded."""
        self._change(pause=True, reason=reason)

    def resume(self, reason: str = "asked by a person") -> None:
        """Ask to go on."""
        self._change(pause=False, reason=reason)

    def abort(self, reason: str = "asked by a person") -> None:
        """Ask for the end, now and in the safe state."""
        self._change(abort=True, reason=reason)

    def interrupt(self, reason: str) -> None:
        """Ask to let the bench go, now and in the safe state; the campaign is to be taken up."""
        self._change(abort=True, taken_up=True, reason=reason)

    def _change(
        self, *, reason: str, pause: bool | None = None, abort: bool | None = None, taken_up: bool = False
    ) -> None:
        with self._lock:
            if self._wish.abort:
                return
            wish = replace(self._wish, reason=reason)
            if pause is not None:
                wish = replace(wish, pause=pause)
            if abort is not None:
                wish = replace(wish, abort=abort, taken_up=taken_up)
            self._wish = wish
