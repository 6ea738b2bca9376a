"""The bench of a campaign whose engine waits for its database: another thread may stop the table meanwhile.

Drivers are for one thread. The engine has the bench while it runs, and lends it while it writes its journal: a writer
that is held, or a disk that stands still, must not keep a table turning that is to be stopped.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, cast

from procedures.contracts.journal import Journal


class BenchLending:
    """Whose turn it is at a bench."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._driver: int | None = None

    @contextmanager
    def driving(self) -> Iterator[None]:
        """Hold the bench in this thread, the engine's."""
        with self._lock:
            self._driver = threading.get_ident()
            try:
                yield
            finally:
                self._driver = None

    @contextmanager
    def lent(self) -> Iterator[None]:
        """Lend the bench to another thread meanwhile; nothing happens where this thread does not hold it."""
        if threading.get_ident() != self._driver:
            yield
            return
        self._driver = None
        self._lock.release()
        try:
            yield
        finally:
            self._lock.acquire()
            self._driver = threading.get_ident()

    @contextmanager
    def borrowed(self, within_s: float) -> Iterator[bool]:
        """Hold the bench in a thread that is not the engine's, once lent; yields False where that takes longer."""
        has_it = self._lock.acquire(timeout=within_s)
        try:
            yield has_it
        finally:
            if has_it:
                self._lock.release()


class _LendingJournal:
    """A journal during whose calls the bench is lent."""

    def __init__(self, journal: Journal, lending: BenchLending) -> None:
        self._journal, self._lending = journal, lending

    def __getattr__(self, name: str) -> Callable[..., Any]:
        method = getattr(self._journal, name)

        def call(*args: Any, **kwargs: Any) -> Any:
            with self._lending.lent():
                return method(*args, **kwargs)

        return call


def lending_journal(journal: Journal, lending: BenchLending) -> Journal:
    """Return the journal; during each of its calls the bench is lent."""
    return cast(Journal, _LendingJournal(journal, lending))
