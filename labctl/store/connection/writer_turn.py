"""Whose turn it is at the one writing connection of a process, and for how long another waits for it."""

from __future__ import annotations

import inspect
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from instruments.clock import Clock, WallClock
from labctl.errors import StoreError

#: How long a writer waits for the one before, s of wall time. Transactions are short (some 50 ms): a process that
#: holds the connection for so long is at fault, and an engine that cannot write down what it measures stops its table.
WRITER_DEADLINE_S = 20.0
#: How long it waits where the one before is overdue already, so that what must still be tried is tried at once.
OVERDUE_DEADLINE_S = 0.5


PASSED_THROUGH = frozenset({__name__, "contextlib", "labctl.store.connection.database"})


@dataclass(frozen=True)
class _Turn:
    thread: str
    function: str
    began_s: float


class WriterTurn:
    """A lock that knows who has it since when; the thread that has it may take it again."""

    def __init__(self, location: str, clock: Clock | None = None) -> None:
        self._location = location
        self._clock = clock or WallClock()
        self._lock = threading.RLock()
        self._turn: _Turn | None = None
        self._is_over = False

    def end(self, within_s: float) -> bool:
        """Refuse writers from now on; waits `within_s` for who writes now. Returns whether the connection is free."""
        if not self._lock.acquire(timeout=within_s):
            return False
        self._is_over = True
        self._lock.release()
        return True

    @contextmanager
    def take(self) -> Iterator[None]:
        """Acquire the connection.

        Raises StoreError, naming who holds it, when it does not come free in time, and where it was closed.
        """
        waits_s = self._patience_s()
        if not self._lock.acquire(timeout=waits_s):
            raise self._overdue(waits_s)
        outer = self._turn
        try:
            if self._is_over:
                cause = f"{self._location}: the database is closed, because the process that writes it ends"
                raise StoreError(f"{cause}; nothing was stored, try again once the service runs", cause=cause)
            if outer is None:
                self._turn = _Turn(threading.current_thread().name, _caller(), self._clock.now_s())
            yield
        finally:
            self._turn = outer
            self._lock.release()

    def _patience_s(self) -> float:
        turn = self._turn
        overdue = turn is not None and self._clock.now_s() - turn.began_s > WRITER_DEADLINE_S
        return OVERDUE_DEADLINE_S if overdue else WRITER_DEADLINE_S

    def _overdue(self, waited_s: float) -> StoreError:
        turn = self._turn
        who = "others, one after the other"
        if turn is not None:
            held_s = self._clock.now_s() - turn.began_s
            who = f"{turn.function} in thread {turn.thread!r}, for {held_s:.3g} s already"
        cause = (
            f"{self._location}: no write access within {waited_s:.3g} s; the only connection that writes is in "
            f"use by {who}"
        )
        return StoreError(f"{cause}; nothing was stored, try again", cause=cause)


def _caller() -> str:
    """Return the function that asked for the connection: the innermost public one outside of the database code."""
    frame = inspect.currentframe()
    while frame is not None and (frame.f_code.co_name.startswith("_") or frame.f_globals["__name__"] in PASSED_THROUGH):
        frame = frame.f_back
    return "" if frame is None else frame.f_code.co_qualname
