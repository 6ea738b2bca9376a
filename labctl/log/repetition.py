"""A bound on records that any client can cause without limit: some are let through, the others are counted."""

from __future__ import annotations

import logging
import threading
from collections.abc import Hashable
from dataclasses import dataclass

from instruments.clock import Clock, SystemClock

PER_S = 600.0
#: Of records of other libraries, from one line of their code.
MOST_FOREIGN = 10


@dataclass
class _Counted:
    since_s: float
    admitted: int = 0
    held_back: int = 0


class RepetitionLimit:
    """Admits `most` records with the same key in `per_s`."""

    def __init__(self, most: int, per_s: float = PER_S, clock: Clock | None = None) -> None:
        self._most, self._per_s, self._clock = most, per_s, clock or SystemClock()
        self._counted: dict[Hashable, _Counted] = {}
        self._guard = threading.Lock()
        self.held_back = 0  #: in all

    def admits(self, key: Hashable) -> bool:
        """Return whether a record with this key is written; count it where it is not."""
        now_s = self._clock.now_s()
        with self._guard:
            found = self._counted.setdefault(key, _Counted(now_s))
            if now_s - found.since_s >= self._per_s:
                found.since_s, found.admitted = now_s, 0
            if found.admitted < self._most:
                found.admitted += 1
                return True
            found.held_back += 1
            self.held_back += 1
            return False

    def take_count(self, key: Hashable) -> int:
        """Return how many with this key were held back since the last call."""
        with self._guard:
            found = self._counted.get(key)
            count = 0 if found is None else found.held_back
            if found is not None:
                found.held_back = 0
        return count

    def take_counts(self) -> dict[str, int]:
        """Return how many were held back since the last call, by key as text."""
        with self._guard:
            taken = {str(key): found.held_back for key, found in self._counted.items() if found.held_back}
            for found in self._counted.values():
                found.held_back = 0
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
