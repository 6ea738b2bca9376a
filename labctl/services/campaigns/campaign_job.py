"""A campaign that runs in a thread: its row, its bench, and the control over it."""

from __future__ import annotations

import threading
from dataclasses import dataclass

from labctl.services.campaigns.bench_lending import BenchLending
from labctl.services.campaigns.preparation import Prepared
from labctl.store import CampaignRow
from procedures.contracts.control import Control
from procedures.monitoring.progress import Progress

#: An engine that does not see an abort within this, s, may be waiting for its database; another thread then takes the
#: bench from it while it writes. Who asked for the stop waits longer, before the process is ended.
HEARD_WITHIN_S, STUCK_S = 0.7, 60.0


@dataclass
class CampaignJob:
    """A campaign that runs now."""

    row: CampaignRow
    prepared: Prepared
    control: Control
    lending: BenchLending
    progress: Progress | None = None
    thread: threading.Thread | None = None

    def stop_if_stuck(self) -> None:
        """Stop the table from here where the engine does not see an abort because it waits for its database."""
        table = self.prepared.bench.table
        if table is None or self.control.is_heard(HEARD_WITHIN_S):
            return
        try:
            complaint = self.lending.stop(table, self.prepared.clock, STUCK_S, self.control.note_heard)
        except Exception as error:  # noqa: BLE001  the engine tries again in its safe state
            complaint = str(error) or type(error).__name__
        self.control.note_safe_state(complaint or "", at_rest=complaint is None)
