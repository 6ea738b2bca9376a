"""A wait that a signal ends at once: the handler writes a byte into a pipe and takes no lock."""

from __future__ import annotations

import contextlib
import os
import select
import signal
from collections.abc import Iterable
from types import FrameType


class Waker:
    """Waits until a signal or another thread wakes it."""

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self.ending = False  #: whether a signal has asked for the end

    def listen_to(self, numbers: Iterable[signal.Signals]) -> None:
        """Take these signals as the request to end, from now on."""
        for number in numbers:
            signal.signal(number, self._handle)

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self.end()

    def end(self) -> None:
        """Ask for the end."""
        self.ending = True
        self.wake()

    def wake(self) -> None:
        """End the present wait, or the next one."""
        with contextlib.suppress(BlockingIOError):  # the pipe is full: the wait ends in any case
            os.write(self._writer, b"!")

    def wait(self, seconds: float) -> None:
        """Wait until woken, at most `seconds`."""
        if select.select([self._reader], [], [], seconds)[0]:
            with contextlib.suppress(BlockingIOError):
                os.read(self._reader, 4096)

    def close(self) -> None:
        """Close the pipe."""
        os.close(self._reader)
        os.close(self._writer)
