"""Who fetched a calibration over HTTP, so that a revocation can name those who have to be notified.

A fetch costs the one who fetches no write: it is noted in memory, and written after the answer was sent. The first
fetch by a key is written at once, later ones at most once in `LAST_KNOWN_TO`, and all when the service ends.
"""

from __future__ import annotations

import threading
from datetime import datetime, timedelta

from labctl.answers.certification import FetchResponse
from labctl.errors import LabctlError
from labctl.log import get_logger
from labctl.store import FetchRow, Store

#: Who fetched without a key.
ANONYMOUS = "anonymous"
#: How well the time of the last fetch is known when a service is killed.
LAST_KNOWN_TO = timedelta(hours=1)
#: Keys and versions in memory; one of more is written at each fetch.
MAX_CACHED = 10_000

_Key = tuple[str, int, str]


class FetchLog:
    """The fetches that one service answers; safe to use from several threads."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._lock = threading.Lock()
        self._writing = threading.Lock()
        self._written: dict[_Key, datetime] = {}
        self._pending: dict[_Key, FetchRow] = {}

    def note(self, serial: str, version: int, who: str, at: datetime) -> bool:
        """Note a fetch at an aware time; returns whether `write` is to be called now.

        A service that only reads notes none.
        """
        if self._store.is_read_only:
            return False
        key = (serial, version, who)
        with self._lock:
            pending = self._pending.get(key)
            self._pending[key] = FetchRow(serial, version, who, pending.first_at if pending else at, at)
            before = self._written.get(key)
            return before is None or at - before >= LAST_KNOWN_TO

    def write(self) -> None:
        """Write what was noted; where another thread does so already, or the database cannot, it is left for later.

        A calibration is served whether or not its fetch can be written.
        """
        if not self._writing.acquire(blocking=False):
            return
        try:
            with self._lock:
                rows, self._pending = self._pending, {}
            if not rows:
                return
            try:
                self._store.fetches.record(list(rows.values()))
            except LabctlError as error:
                self._put_back(rows)
                get_logger().warning("fetches.not_written", said=str(error))
                return
            with self._lock:
                if len(self._written) + len(rows) > MAX_CACHED:
                    self._written.clear()
                self._written.update((key, row.last_at) for key, row in rows.items())
        finally:
            self._writing.release()

    def _put_back(self, rows: dict[_Key, FetchRow]) -> None:
        with self._lock:
            for key, row in rows.items():
                if (later := self._pending.get(key)) is not None:
                    self._pending[key] = FetchRow(*key, row.first_at, later.last_at)
                elif len(self._pending) < MAX_CACHED:
                    self._pending[key] = row


def fetched_by(store: Store, serial: str, version: int) -> list[FetchResponse]:
    """Return who fetched a version, the newest fetch first. Raises NotFound."""
    store.calibrations.get(serial, version)
    rows = store.fetches.of_version(serial, version)
    return [FetchResponse(who=row.who, first_at=row.first_at, last_at=row.last_at) for row in rows]
