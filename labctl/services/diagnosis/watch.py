"""Diagnoses that a service carries out: those on its bench advance in a thread of its own, beside the bench."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import nullcontext

from instruments.clock import Clock
from labctl.errors import BenchSilent, Conflict, StoreError, TooBusy
from labctl.log import get_logger
from labctl.services.background import BackgroundWork
from labctl.services.diagnosis.advance import DiagnosisRunner, Laboratory
from labctl.services.diagnosis.begin import MOVING
from labctl.store import Store

log = get_logger()

#: A move that fails is tried so often; then the diagnosis waits for a person.
TRIES = 3
#: What passes by itself: the move is made later.
PASSING = (TooBusy, StoreError, BenchSilent, Conflict)


class DiagnosisWatch:
    """Makes the moves of the diagnoses on one bench, one after the other."""

    def __init__(self, store: Store, clock: Clock, bench: Callable[[], str | None], laboratory: Laboratory) -> None:
        """`bench` returns the name of the bench; None: this service has none, and carries out nothing."""
        self._store, self._clock, self._bench = store, clock, bench
        self._runner = DiagnosisRunner(lambda: nullcontext(store), laboratory, clock.utc)
        self._tries: Counter[int] = Counter()
        self.background = BackgroundWork("diagnoses", "diagnosis.waits", clock, self.tick)

    def tick(self) -> None:
        """Make the moves that can be made now. Raises StoreError where the database cannot be read."""
        bench = self._bench()
        for row in [] if bench is None else self._store.diagnoses.moving(bench):
            try:
                while not self.background.is_over and self._runner.advance(row.id):
                    self._tries.pop(row.id, None)
            except PASSING as error:
                self.background.note(error)
            except Exception as error:  # noqa: BLE001  of whatever kind: tried again, then written down
                if not self.background.is_over:  # else the computation was ended with the service
                    self._failed(row.id, error)

    def _failed(self, diagnosis: int, error: Exception) -> None:
        """Try again the next time; after `TRIES` write down that a person has to see to it."""
        self._tries[diagnosis] += 1
        reason = f"{type(error).__name__}: {error}"
        log.warning("diagnosis.trouble", diagnosis=diagnosis, tries=self._tries[diagnosis], error=reason)
        if self._tries[diagnosis] >= TRIES:
            self._tries.pop(diagnosis)
            self._store.diagnoses.halt(diagnosis, MOVING, "failed", reason, self._clock.utc())
