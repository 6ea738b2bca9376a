"""Single flight: threads that ask the same question at the same time work at it in turn, the first for all."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from weakref import WeakValueDictionary

from labctl.progress import Cancelled, Progress, progress, reporting_to

#: A thread that waits for another's result looks this often whether its own caller still wants it, s.
POLL_INTERVAL_S = 0.1


class _Flight:
    """One question that threads work at in turn; forgotten when no thread holds it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._guard = threading.Lock()
        self._wanted_by: list[Progress] = []
        self._stage = "waiting for the same computation"

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Work at the question as the only thread; its stages are reported to all threads that wait for their turn.

        Raises Cancelled where the caller does not want the result any more. The work of a thread whose caller has left
        goes on while another waits for its result.
        """
        show_progress = progress()
        with self._guard:
            self._wanted_by.append(show_progress)
        try:
            while not self._lock.acquire(timeout=POLL_INTERVAL_S):
                show_progress(self._stage)
            try:
                with reporting_to(self._report):
                    yield
            finally:
                self._lock.release()
        finally:
            self._leave(show_progress)

    def _report(self, stage: str) -> None:
        self._stage = stage
        with self._guard:
            wanted_by = list(self._wanted_by)
        for each in wanted_by:
            try:
                each(stage)
            except Cancelled:
                self._leave(each)
        with self._guard:
            if not self._wanted_by:
                raise Cancelled(stage)

    def _leave(self, who: Progress) -> None:
        with self._guard:
            if who in self._wanted_by:
                self._wanted_by.remove(who)


_flights: WeakValueDictionary[str, _Flight] = WeakValueDictionary()
_flights_guard = threading.Lock()


@contextmanager
def single_flight(key: str) -> Iterator[None]:
    """Allow one thread of this process at a time to work at the same question. Raises Cancelled."""
    with _flights_guard:
        flight = _flights.setdefault(key, _Flight())
    with flight.turn():
        yield
