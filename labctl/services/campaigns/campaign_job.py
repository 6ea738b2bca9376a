"""A campaign that runs in a thread: its row, its bench, and the control over it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from instruments.clock import Clock
from instruments.interfaces.table import RateTable
from labctl.errors import DatabaseUnreachable, StoreError
from labctl.services.campaigns.bench_lending import BenchLending
from labctl.services.campaigns.preparation import Prepared
from labctl.store import CampaignRow
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control
from procedures.execution.safe_state import stop_table
from procedures.monitoring.progress import Progress

#: An engine that does not make its bench safe within this from a stop, s, may be waiting for its database; another
#: thread then takes the bench from it while it writes. Who asked for the stop waits longer before the process is ended.
LEAVES_WITHIN_S, STUCK_S = 0.3, 60.0
#: How often it is read, beside the engine, whether the bench may still be driven, s of wall time.
LOSS_READ_S = 1.0


@dataclass
class CampaignJob:
    """A campaign that runs now."""

    row: CampaignRow
    prepared: Prepared
    control: Control
    lending: BenchLending
    progress: Progress | None = None
    thread: threading.Thread | None = None

    def start(self, run: Callable[[], None]) -> None:
        """Run the campaign in a thread; another one, ready from the beginning, stops its table where it must."""
        threading.Thread(target=self._stop_if_stuck, name="stop", daemon=True).start()
        self.thread = threading.Thread(target=run, name=f"campaign-{self.prepared.id}")
        self.thread.start()

    @property
    def is_safe(self) -> bool:
        """Whether its table stands and nothing of its safe state is unconfirmed."""
        return self.control.is_at_rest(0.0) and not self.control.hindrance

    def is_resumed_after(self, error: StoreError) -> bool:
        """Return whether it goes on by itself once its database answers again: nothing else has ended it.

        Of one that was done only the end is written.
        """
        ended = None if self.progress is None else self.progress.state
        is_open = ended in {CampaignState.INTERRUPTED, CampaignState.DONE}
        return isinstance(error, DatabaseUnreachable) and is_open and self.is_safe

    def _stop_if_stuck(self) -> None:
        """Stop the table from here where the engine does not, because what it writes down first waits for its database.

        The stop may come from a person, a signal, or the lease of the bench, lost to another.
        """
        while not self.control.wait_for_end(LOSS_READ_S):
            self.control.interrupt_if_lost()
        table = self.prepared.bench.table
        if table is None or self.control.has_left_step(LEAVES_WITHIN_S):
            return
        with self.lending.borrowed(STUCK_S) as has_it:
            if self.control.has_left_step(0.0):  # the engine makes the bench safe, or has done so
                return
            if not has_it:
                complaint: str | None = "the running campaign did not release the bench in time; try again"
            else:
                self.control.note_heard()
                complaint = _stopped(table, self.prepared.clock)
            self.control.note_safe_state(complaint or "", at_rest=complaint is None)


def _stopped(table: RateTable, clock: Clock) -> str | None:
    """Stop a table; returns what could not be confirmed: the engine tries again in its safe state."""
    try:
        return stop_table(table, clock)
    except Exception as error:  # noqa: BLE001  it is the answer, whatever it is
        return str(error) or type(error).__name__
