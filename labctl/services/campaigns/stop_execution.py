"""Carrying out the stops of one bench: those that a caller asks for now, and those that the latch holds open."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

from instruments.clock import WallClock
from labctl.errors import StoreError
from labctl.log import get_logger
from labctl.services.benches.stops import BenchStops
from labctl.services.campaigns.campaign_job import CampaignJob
from labctl.services.campaigns.recovery import CampaignRecovery
from labctl.services.campaigns.stop_requests import CampaignStop, IdleStop, StopElsewhere
from labctl.stop.latch import StopRequest
from labctl.stop.wire import Stopping

log = get_logger()

#: How often the latch is read, s of wall time.
LATCH_READ_S = 0.5


class StopExecution:
    """Ends what runs on a bench, and completes what a stop needs once nothing runs any more.

    `guard` is held while something is begun on the bench or the bench is made safe without a campaign; `job` returns
    the campaign that runs, `may_drive` whether the bench may be driven here, and `secure` makes the bench safe under
    the guard and returns what is not confirmed.
    """

    def __init__(
        self,
        latch: BenchStops,
        recovery: CampaignRecovery,
        guard: threading.Lock,
        job: Callable[[], CampaignJob | None],
        may_drive: Callable[[], bool],
        secure: Callable[[], str],
    ) -> None:
        self._latch, self._recovery, self._guard = latch, recovery, guard
        self._job, self._may_drive, self._secure = job, may_drive, secure
        self.is_safe = False  #: whether the safe state was confirmed here since anything moved
        self.requested: StopRequest | None = None  #: the stop of the campaign that was stopped last
        self._over = threading.Event()
        self._watch: threading.Thread | None = None

    def request(self, stop: StopRequest) -> Stopping:
        """Begin a stop; returns how it goes on. Waits for no lock, no disk and no database."""
        job = self._job()
        if job is not None and stop.campaign not in {None, job.row.id}:
            return StopElsewhere(_another(job, stop), stands=False)
        if job is None:
            self._latch.remember(stop)  # also that of a campaign that has ended: a start asked for before it waits here
            return IdleStop(lambda: self._idle(stop))
        self.requested = stop = replace(stop, campaign=job.row.id)
        job.control.abort(stop.reason)
        self._latch.remember(stop)
        log.warning("campaign.stop", campaign=job.row.id, bench=job.row.bench_name, reason=stop.reason)
        return CampaignStop.of(job)

    def _idle(self, stop: StopRequest) -> CampaignStop | str:
        """Make a bench safe on which no campaign runs; a campaign that has begun meanwhile is ended."""
        with self._guard:
            job = self._job()
            if job is not None and stop.campaign in {None, job.row.id}:
                job.control.abort(stop.reason)
                return CampaignStop.of(job)
            if job is not None:
                return _another(job, stop)
            outcome = self._secure()
            self.carry_out()
            return outcome

    def request_left(self, stop: StopRequest) -> Stopping:
        """Begin the stop of a campaign that an earlier process left: it may be about to be resumed."""
        self._latch.remember(stop)
        return self.request(stop)

    def carry_out(self) -> None:
        """Carry out what the latch holds open, under the guard, while no campaign runs. Raises StoreError.

        The bench is made safe, what was left unfinished is ended, and each stop is written into the audit trail,
        before the latch is changed.
        """
        stops = self._latch.state.open
        if not stops or self._job() is not None or not self._may_drive():
            return
        problem = "" if self.is_safe else self._secure()
        for stop in stops:
            self._recovery.close_stopped(stop.campaign, stop.reason)
            self._latch.record(stop, WallClock().utc())
        self._latch.carried_out(stops, problem or "the bench is in its safe state")
        log.warning("stop.carried_out", stops=[stop.reason for stop in stops], unconfirmed=problem)

    def watch(self) -> None:
        """Read the latch from now on, in a thread: a stop may have been asked for while no process answered."""
        self._latch.prepare()
        self._watch = threading.Thread(target=self._keep_watching, name="latch-watch", daemon=True)
        self._watch.start()

    def _keep_watching(self) -> None:
        while not self._over.wait(LATCH_READ_S):
            self.settle()

    def settle(self) -> None:
        """Do what the latch asks for, as far as that is possible now. Raises nothing."""
        try:
            self.read_latch()
        except Exception as error:  # noqa: BLE001  the stop stays open, and is tried again
            log.error("stop.not_carried_out", error=str(error) or type(error).__name__)

    def read_latch(self) -> None:
        """Stop what runs if the latch asks for it, else carry out what is open."""
        stops, job = self._latch.state.open, self._job()
        if stops and job is None and self._guard.acquire(blocking=False):
            try:
                self.carry_out()
            finally:
                self._guard.release()
        for stop in stops if job is not None else ():
            if job is not None and stop.campaign in {None, job.row.id} and not job.control.request.abort:
                self.request(stop)

    def end_soon(self) -> None:
        """End the thread that reads the latch."""
        self._over.set()
        if self._watch is not None:
            self._watch.join()

    def close(self) -> None:
        """Carry out what is still open; what cannot be written stays open for the next process."""
        try:
            with self._guard:
                self.carry_out()
        except (StoreError, OSError) as error:
            log.error("stop.not_carried_out", error=str(error))


def _another(job: CampaignJob, stop: StopRequest) -> str:
    """Return why a stop of one campaign does not end another."""
    return f"campaign {job.row.id} runs on this bench, not campaign {stop.campaign}, and goes on"
