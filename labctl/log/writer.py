"""Writes lines to a file descriptor in a thread of its own. Who hands a line over never waits, and never fails.

The queue is bounded: a reader that stands still, or a full disk, costs records, which are counted, and nothing else.
"""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable, Iterable
from queue import Empty, SimpleQueue

#: Lines that wait at most; with the longest records some 30 MiB.
CAPACITY = 2048
#: A descriptor that takes nothing for so long loses the line, s; only where it does not block by itself.
TAKES_WITHIN_S = 5.0
#: How often `notes` is called at least, s.
NOTES_EVERY_S = 60.0
#: How long the end of a process waits for what has not been written, s; and for a reader that takes nothing more.
END_WITHIN_S, STUCK_S = 2.0, 0.3

_Item = str | threading.Event | None  #: a line, a waiting thread, the end


class LogWriter:
    """One output of one process. `put` may be called by any thread, also by one that a signal interrupts."""

    def __init__(
        self,
        descriptor: int | None,
        *,
        notes: Callable[[int], Iterable[str]] = lambda _: (),
        capacity: int = CAPACITY,
        notes_every_s: float = NOTES_EVERY_S,
    ) -> None:
        """Write to a descriptor, which is closed at the end; None: there is nothing to write to.

        `notes` is given how many lines were lost since the last time, and returns further lines; it is called before a
        line that follows a loss, and every `notes_every_s`.
        """
        self._descriptor, self._notes, self._capacity, self._notes_every_s = descriptor, notes, capacity, notes_every_s
        #: Not `queue.Queue`: its lock could be held by the very thread that an interrupt ends.
        self._queue: SimpleQueue[_Item] = SimpleQueue()
        self._reported = 0
        self.lost = 0  #: lines that were not written
        self._written = 0  #: pieces of lines that were
        self._thread = threading.Thread(target=self._write_all, name="log", daemon=True)
        self._thread.start()

    def put(self, line: str) -> None:
        """Queue a line, without its end; it is dropped where too many wait."""
        if self._queue.qsize() >= self._capacity:
            self.lost += 1
        else:
            self._queue.put(line)

    def flush(self, within_s: float = END_WITHIN_S) -> bool:
        """Wait until what was handed over is written, at most so long; returns whether it is."""
        written = threading.Event()
        self._queue.put(written)
        return written.wait(within_s)

    def close(self, within_s: float = END_WITHIN_S) -> None:
        """Write what was handed over and end; what is not written within that time may be lost.

        A reader that stands still, on a computer that lets this process run, is not waited for.
        """
        self._queue.put(None)
        left_s = within_s
        while self._thread.is_alive() and left_s > 0.0:
            before = self._written
            self._thread.join(min(STUCK_S, left_s))
            left_s -= STUCK_S
            if self._written == before and self._descriptor is not None and not takes_text(self._descriptor):
                return

    def _write_all(self) -> None:
        while (item := self._next()) is not None:
            if isinstance(item, threading.Event):
                self._write_notes()
                item.set()
                continue
            if self.lost > self._reported:
                self._write_notes()
            self._write(item)
        self._write_notes()
        if self._descriptor is not None:
            os.close(self._descriptor)  # here: at another thread's word it could be another file's by now

    def _next(self) -> _Item:
        """Return what is to be done next; an empty queue is a time for notes."""
        while True:
            try:
                return self._queue.get(timeout=self._notes_every_s)
            except Empty:
                self._write_notes()

    def _write_notes(self) -> None:
        lost = self.lost
        written = [self._write(line) for line in self._notes(lost - self._reported)]
        if all(written):
            self._reported = lost

    def _write(self, line: str) -> bool:
        rest = line.encode("utf-8", "backslashreplace") + b"\n"
        try:
            while rest:
                rest = rest[self._piece(rest) :]
        except OSError:
            self.lost += 1
            return False
        return True

    def _piece(self, rest: bytes) -> int:
        """Write as much as is taken; returns how much. Raises OSError."""
        if self._descriptor is None:
            raise OSError("no output")
        try:
            taken = os.write(self._descriptor, rest)
        except BlockingIOError:
            if not select.select([], [self._descriptor], [], TAKES_WITHIN_S)[1]:
                raise
            return 0
        self._written += 1
        return taken


def takes_text(descriptor: int, within_s: float = 0.0) -> bool:
    """Return whether a descriptor takes a line without waiting: False for a full pipe whose reader stands still."""
    try:
        return bool(select.select([], [descriptor], [], within_s)[1])
    except (OSError, ValueError):  # it is closed: writing fails at once
        return True
