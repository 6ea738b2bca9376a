"""A bound on records that any client can cause without limit: some are let through, the others are counted."""

from __future__ import annotations

import logging
import threading
from collections.abc import Hashable
from dataclasses import dataclass

from instruments.clock import Clock, SystemClock

WINDOW_S = 600.0
#: Of records of other libraries, from one line of their code.
MAX_FOREIGN = 10


@dataclass
class _Counted:
    since_s: float
    admitted: int = 0
    held_back: int = 0


class RepetitionLimit:
    """Admits `most` records with the same key in `window_s`."""

    def __init__(self, most: int, window_s: float = WINDOW_S, clock: Clock | None = None) -> None:
        self._most, self._window_s, self._clock = most, window_s, clock or SystemClock()
        self._counted: dict[Hashable, _Counted] = {}
        self._guard = threading.Lock()
        self.held_back = 0  #: in all

    def admits(self, key: Hashable) -> bool:
        """Return whether a record with this key is written; count it where it is not."""
        now_s = self._clock.now_s()
        with self._guard:
            counted = self._counted.setdefault(key, _Counted(now_s))
            if now_s - counted.since_s >= self._window_s:
                counted.since_s, counted.admitted = now_s, 0
            if counted.admitted < self._most:
                counted.admitted += 1
                return True
            counted.held_back += 1
            self.held_back += 1
            return False

    def take_count(self, key: Hashable) -> int:
        """Return how many with this key were held back since the last call."""
        with self._guard:
            counted = self._counted.get(key)
            count = 0 if counted is None else counted.held_back
            if counted is not None:
                counted.held_back = 0
        return count

    def take_counts(self) -> dict[str, int]:
        """Return how many were held back since the last call, by key as text."""
        with self._guard:
            taken = {str(key): counted.held_back for key, counted in self._counted.items() if counted.held_back}
            for counted in self._counted.values():
                counted.held_back = 0
        return taken


class ForeignRecordLimit(logging.Filter):
    """Bounds what other libraries log, as a server does about every request that it cannot read."""

    def __init__(self, limit: RepetitionLimit) -> None:
        super().__init__()
        self._limit = limit

    def filter(self, record: logging.LogRecord) -> bool:
        """Return whether a record is written."""
        about = f" {device}" if (device := getattr(record, "device", "")) else ""
        return self._limit.admits(f"{record.name}, {record.module} line {record.lineno}{about}")
