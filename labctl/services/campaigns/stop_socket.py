"""Stops of a campaign that runs in the foreground of its process: a socket for them, and what an earlier stop asks."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from instruments.bench_config import BenchFile
from labctl.services.benches.stops import BenchStops
from labctl.services.campaigns.stop_requests import CampaignStop
from labctl.stop.latch import StopRequest
from labctl.stop.places import DriverNote, ProcessId
from labctl.stop.wire import StopServer
from labctl.store import Store
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control


def let_move(store: Store, bench: str, by: str, at: datetime) -> None:
    """Allow a bench to move again, in the name of the person who starts or resumes a campaign at a terminal.

    A stop that no process carried out is written down first, and what it was to end is ended. Raises StoreError.
    """
    stops = BenchStops(store, bench)
    if still := stops.state.open:
        for stop in still:
            for row in store.campaigns.unfinished():
                if row.bench_name == bench and stop.campaign in {None, row.id}:
                    store.campaigns.close_unfinished(row.id, f"aborted: {stop.reason}", at, CampaignState.ABORTED)
            stops.record(stop, at)
        stops.carried_out(still, "carried out before the next campaign")
    stops.take_back(by)


@contextmanager
def answering_stops(store: Store, bench: BenchFile, campaign: int, control: Control) -> Iterator[None]:
    """Answer `labctl stop` while a campaign runs in this process; nothing for a bench that is simulated in it."""
    if bench.is_simulated:
        yield
        return
    stops, ended = BenchStops(store, bench.name), threading.Event()
    stops.prepare()

    def respond(stop: StopRequest) -> CampaignStop:
        control.abort(stop.reason)
        stops.remember(stop)
        return CampaignStop(campaign, control, ended.is_set)

    folder = Path(tempfile.mkdtemp(prefix="labctl-stop-"))
    server = StopServer(folder / "stop", respond)
    server.start()
    document = bench.model_dump(mode="json")
    note = DriverNote(bench.name, ProcessId.of(os.getpid()), str(folder / "stop"), document=document)
    try:
        with contextlib.suppress(OSError):
            stops.place.write_note(note)
        yield
    finally:
        ended.set()
        with contextlib.suppress(OSError):
            safe = control.is_at_rest(0.0) and not control.hindrance
            outcome = f"campaign {campaign} ended; {control.hindrance or 'the bench is in its safe state'}"
            stops.place.write_note(DriverNote(bench.name, document=document, left=outcome, left_safe=safe))
        server.close()
        shutil.rmtree(folder, ignore_errors=True)


def note_carried_out(store: Store, bench: str, at: datetime) -> None:
    """Write down the stops of a campaign that has ended here. Raises StoreError."""
    stops = BenchStops(store, bench)
    if still := stops.state.open:
        for stop in still:
            stops.record(stop, at)
        stops.carried_out(still, "the campaign ended in the safe state")
