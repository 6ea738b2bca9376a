"""Runs campaigns on one bench, one at a time, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from instruments.bench import BenchFile
from instruments.clock import Clock
from labctl.errors import BenchBusy
from labctl.services.acts import CampaignRequest
from labctl.services.answers import CampaignAnswer
from labctl.services.campaigns import answer_of, campaign_status
from labctl.services.leases import BenchHold
from labctl.services.running import Prepared, prepare, run
from labctl.store import CampaignRow, Store
from procedures.control import Control
from procedures.progress import Progress

#: How long closing waits for a campaign to reach its safe state.
SAFE_WITHIN_S = 120.0


@dataclass
class _Job:
    """A campaign that runs now."""

    row: CampaignRow
    control: Control
    progress: Progress | None = None
    thread: threading.Thread | None = None


class BenchRunner:
    """The one that drives this service's bench."""

    def __init__(
        self, store: Store, bench: BenchFile, make_clock: Callable[[], Clock], hold: BenchHold | None = None
    ) -> None:
        self._store = store
        self._hold = hold
        self._bench = bench
        self._make_clock = make_clock
        self._guard = threading.Lock()
        self._job: _Job | None = None
        self._listeners: list[Callable[[], None]] = []

    @property
    def bench(self) -> BenchFile:
        """The bench that is driven."""
        return self._bench

    @property
    def busy(self) -> bool:
        """Whether a campaign runs now."""
        return self._job is not None

    def runs(self, campaign: int) -> bool:
        """Whether this campaign runs here now."""
        job = self._job
        return job is not None and job.row.id == campaign

    def start(self, request: CampaignRequest) -> CampaignAnswer:
        """Plan, write down and begin a campaign.

        Raises BenchBusy while another runs, Conflict without the lease on the bench, and whatever planning raises.
        """
        with self._guard:
            if self._job is not None:
                raise BenchBusy(
                    f"bench {self._bench.name} runs campaign {self._job.row.id} now; wait for its end or abort it"
                )
            if self._hold is not None:
                self._hold.check()
            prepared = prepare(self._store, request.recipe, self._bench, self._make_clock(), clip=request.clip)
            control = Control() if self._hold is None else self._hold.control()
            job = _Job(self._store.campaigns.get(prepared.id), control)
            job.thread = threading.Thread(target=self._run, args=(job, prepared), name=f"campaign-{prepared.id}")
            self._job = job
            job.thread.start()
        return campaign_status(self._store, prepared.id)

    def _run(self, job: _Job, prepared: Prepared) -> None:
        def seen(progress: Progress) -> None:
            job.progress = progress
            self._ring()

        try:
            run(self._store, prepared, job.control, seen)
        finally:
            self._job = None
            self._ring()

    def _ring(self) -> None:
        for listener in tuple(self._listeners):
            listener()

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` whenever something has changed; returns what ends that. A listener may not block."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def status(self, campaign: int) -> CampaignAnswer | None:
        """Return the live picture of a campaign that runs here."""
        job = self._job
        if job is None or job.row.id != campaign or job.progress is None:
            return None
        return answer_of(self._store.campaigns.get(campaign), job.progress)

    def abort(self, campaign: int, reason: str) -> CampaignAnswer:
        """End the running campaign in the safe state; returns once it is there."""
        job = self._job
        if job is not None and job.row.id == campaign and job.thread is not None:
            job.control.abort(reason)
            job.thread.join(SAFE_WITHIN_S)
        return campaign_status(self._store, campaign)

    def describe(self) -> dict[str, Any]:
        """Return the bench and what it is doing."""
        job = self._job
        return {
            "name": self._bench.name,
            "simulated": self._bench.is_simulated,
            "latitude_deg": self._bench.latitude_deg,
            "units": [{"name": g.name, "serial": g.serial, "driver": g.driver} for g in self._bench.gyros],
            "campaign": job.row.id if job is not None else None,
        }

    def close(self) -> None:
        """End what runs, in the safe state, and let the bench go."""
        job = self._job
        if job is not None and job.thread is not None:
            job.control.abort("the service stops")
            job.thread.join(SAFE_WITHIN_S)
        if self._hold is not None and not (job and job.thread and job.thread.is_alive()):
            self._hold.close()
