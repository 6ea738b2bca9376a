"""Jobs that a service carries out, one after the other in a thread of its own, also those that another one has left."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

from instruments.clock import Clock
from labctl.errors import LabctlError
from labctl.services.background import BackgroundWork
from labctl.services.fleet.engines import Engine
from labctl.services.fleet.foreground import this_process
from labctl.services.fleet.runner import carry_out
from labctl.store import Store


class FleetWatch:
    """Carries out the jobs that no other process carries out."""

    def __init__(self, store: Store, clock: Clock, open_engine: Callable[[str], Engine]) -> None:
        """`open_engine` opens an engine by its name."""
        self._store, self._clock, self._open_engine = store, clock, open_engine
        self.background = BackgroundWork("fleet jobs", "fleet.waits", clock, self.tick)

    def tick(self) -> None:
        """Carry out what is to be done now. Raises StoreError where the database cannot be used."""
        for row in self._store.fleet.open():
            if self.background.is_over:
                return
            with suppress(LabctlError):  # the job has ended with this reason
                carry_out(
                    self._store, self._clock, row.id, this_process(), partial(self._open_engine, row.engine),
                    over=lambda: self.background.is_over,
                )  # fmt: skip
