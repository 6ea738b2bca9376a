"""A campaign that runs in a thread: its row, its bench, and the control over it."""

from __future__ import annotations

import threading
from dataclasses import dataclass

from labctl.services.campaigns.bench_lending import BenchLending
from labctl.services.campaigns.preparation import Prepared
from labctl.store import CampaignRow
from procedures.contracts.control import Control
from procedures.monitoring.progress import Progress

#: An engine that runs sees an abort within this, s; another thread may take the bench from one that writes, until then.
HEARD_WITHIN_S, STUCK_S = 1.5, 60.0


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
        if table is not None and not self.control.is_heard(HEARD_WITHIN_S):
            self.lending.stop(table, self.prepared.clock, STUCK_S)
