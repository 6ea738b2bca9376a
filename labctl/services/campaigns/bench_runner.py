"""Runs campaigns on one bench, one at a time, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.errors import BenchBusy, Conflict, StoreError
from labctl.log import get_logger
from labctl.services.benches.check import checked, description
from labctl.services.benches.confirmation import SafeStateRetry
from labctl.services.benches.lease import BenchHold
from labctl.services.benches.start_confirmation import confirmation_text
from labctl.services.campaigns.bench_lending import BenchLending
from labctl.services.campaigns.campaign_job import CampaignJob
from labctl.services.campaigns.execution import run
from labctl.services.campaigns.listeners import ChangeListeners
from labctl.services.campaigns.preparation import Prepared, prepare, refuse_unconfirmed
from labctl.services.campaigns.recovery import CampaignRecovery, secure_bench
from labctl.services.campaigns.resume import prepare_resume, with_original_simulation
from labctl.services.campaigns.status import answer_of, campaign_status
from labctl.services.planning.loading import with_drivers
from labctl.services.schemas.benches import BenchCheckResponse, BenchDescription
from labctl.services.schemas.campaigns import (
    CampaignRequest,
    CampaignResponse,
    ConfirmRequest,
    ReasonRequest,
    ResumeRequest,
)
from labctl.services.simulation.hidden_effects import with_hidden_effects
from labctl.store import Store
from procedures.contracts.campaign_state import ENDED, CampaignState
from procedures.contracts.control import Control
from procedures.contracts.errors import StalePrompt
from procedures.contracts.operator import Answer, HumanOperator
from procedures.execution.signals import ignore_signals
from procedures.monitoring.progress import Progress

log = get_logger()

#: How long an abort waits for the safe state before it returns how far the campaign is.
SAFE_WITHIN_S = 120.0
STOPS = "the service stops"


class BenchRunner:
    """The one that drives this service's bench."""

    def __init__(
        self,
        store: Store,
        bench: BenchFile,
        make_clock: Callable[[], Clock],
        hold: BenchHold | None = None,
        *,
        safe_within_s: float = SAFE_WITHIN_S,
    ) -> None:
        self._store = store
        self.safe_within_s = safe_within_s  #: how long an abort waits before it says how far it is
        self._hold = hold
        self._bench = bench
        self._make_clock = make_clock
        self._guard = threading.Lock()
        self._job: CampaignJob | None = None
        self._recovery = CampaignRecovery(store, bench, make_clock)
        self._stops = False
        self._stop_requested: int | None = None  #: the campaign that was stopped last
        self._last_check: BenchCheckResponse | None = None
        self.used = False  #: whether anything was asked of the bench here
        self._listeners = ChangeListeners()
        #: Tries the safe state again while it is unconfirmed; started by the process that serves the bench.
        self.safe_state = SafeStateRetry(store, bench, make_clock, self._guard, self._is_idle)

    @property
    def bench(self) -> BenchFile:
        """The bench that is driven."""
        return self._bench

    @property
    def busy(self) -> bool:
        """Whether a campaign runs now."""
        return self._job is not None

    @property
    def running(self) -> int | None:
        """The campaign that runs now."""
        job = self._job
        return None if job is None else job.row.id

    @property
    def free(self) -> bool:
        """Whether a campaign may begin now: nothing runs, or waits to be resumed, and the bench may be driven."""
        return self._job is None and not self._recovery.pending and not self._stops and self._may_drive

    @property
    def _may_drive(self) -> bool:
        return self._hold is None or self._hold.held

    def _is_idle(self) -> bool:
        return self._job is None and self._may_drive

    def runs_or_was_stopped(self, campaign: int) -> bool:
        """Return whether a campaign runs, or was the last one asked to stop: its abort may not be recorded yet."""
        return campaign == self._stop_requested or self.runs(campaign)

    def runs(self, campaign: int) -> bool:
        """Whether this campaign runs here now."""
        return self.running == campaign

    def start(self, request: CampaignRequest) -> CampaignResponse:
        """Plan, write down and begin a campaign.

        Raises BenchBusy while another runs or without the lease on the bench, StartNotConfirmed where no person has
        confirmed that a real bench is clear, and whatever planning raises.
        """
        with self._guard:
            self._refuse_unless_free()
            bench = with_hidden_effects(self._bench, request.hide)
            refuse_unconfirmed(self._store, bench.name)
            clear = confirmation_text(bench, request)
            recipe, clock = request.recipe, self._make_clock()
            prepared = prepare(self._store, recipe, bench, clock, clip=request.clip, fit=request.fit, bench_clear=clear)
            self._begin(prepared)
        return campaign_status(self._store, prepared.id)

    def check(self) -> BenchCheckResponse:
        """Ask every instrument what it is and how it does; nothing moves. Raises BenchBusy while a campaign runs."""
        with self._guard:
            self._refuse_unless_free()
            self._last_check = checked(with_drivers(self._bench), self._bench.name, self._make_clock())
            return self._last_check

    def _refuse_unless_free(self) -> None:
        if self._stops:
            raise BenchBusy(f"bench {self._bench.name}: {STOPS} and starts no campaign; start the service again first")
        if self._job is not None:
            number = self._job.row.id
            raise BenchBusy(f"bench {self._bench.name} runs campaign {number} now; wait for its end, or abort it")
        self._recovery.record_end()
        if self._hold is not None:
            self._hold.check()

    def _begin(self, prepared: Prepared) -> None:
        control = Control() if self._hold is None else self._hold.control()
        job = CampaignJob(self._store.campaigns.get(prepared.id), prepared, control, BenchLending())
        job.thread = threading.Thread(target=self._run, args=(job, prepared), name=f"campaign-{prepared.id}")
        self._job = job
        self.used = True
        if self._stops:  # while the bench was being opened
            control.abort(STOPS)
        job.thread.start()

    def resume(self, campaign: int, request: ResumeRequest) -> CampaignResponse:
        """Continue a paused campaign, or resume one that was interrupted, failed or aborted.

        Raises BenchBusy while another runs or without the lease on the bench, Conflict when it is done, or when the
        bench waits to be inspected.
        """
        with self._guard:
            job = self._job
            if job is not None and job.row.id == campaign:
                if not job.control.request.pause:
                    raise Conflict(f"campaign {campaign} is running, so there is nothing to resume; let it run")
                job.control.resume(f"{request.reason or 'goes on'} ({request.by})")
            else:
                self._refuse_unless_free()
                make_clock = self._make_clock
                bench = with_original_simulation(self._store.campaigns.get(campaign), self._bench)
                self._begin(prepare_resume(self._store, campaign, bench, lambda _: make_clock(), request))
        return self.status(campaign) or campaign_status(self._store, campaign)

    def resume_unfinished(self) -> None:
        """Resume the campaign that was left unfinished on this bench; what prevents it becomes its reason.

        Without the lease nothing is changed: the process that has it by now may be resuming the campaign.
        """
        self._recovery.expect_resume()
        if self._may_drive:
            self._recovery.resume_newest(
                lambda number: self.resume(number, ResumeRequest(by="the service")), self._secure
            )

    def _secure(self) -> None:
        with self._guard:
            self.used = True
            secure_bench(self._store, self._bench, self._make_clock())

    def resume_interrupted(self) -> None:
        """Once the bench may be driven again, resume the campaign that was interrupted when it was lost."""
        self._recovery.record_end()
        if self._recovery.has_unfinished and self._job is None and self._may_drive:
            self.resume_unfinished()

    def pause(self, campaign: int, request: ReasonRequest) -> CampaignResponse:
        """Ask the running campaign to hold after the present data set. Raises Conflict when it does not run here."""
        self._running(campaign).control.pause(request.text)
        return self.status(campaign) or campaign_status(self._store, campaign)

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        """Answer the open question. Raises StalePrompt for any other one, Conflict when nothing is asked here."""
        operator = self._running(campaign).prepared.operator
        if not isinstance(operator, HumanOperator):
            raise StalePrompt(f"question {request.prompt!r} does not exist: this bench asks no person; send no answer")
        operator.reply(Answer(request.prompt, request.confirmed, request.by, request.reason, request.again))
        return self.status(campaign) or campaign_status(self._store, campaign)

    def _running(self, campaign: int) -> CampaignJob:
        job = self._job
        over = job is not None and job.progress is not None and job.progress.state in ENDED
        if job is None or job.row.id != campaign or over:
            state = self._store.campaigns.get(campaign).state
            raise Conflict(
                f"campaign {campaign} does not run on bench {self._bench.name} now (its state: {state}); check "
                "the number of the campaign"
            )
        return job

    def _run(self, job: CampaignJob, prepared: Prepared) -> None:
        def seen(progress: Progress) -> None:
            job.progress = progress
            self._listeners.notify()

        try:
            answer = run(self._store, prepared, job.control, seen, job.lending)
            if answer.state is CampaignState.INTERRUPTED:
                self._recovery.expect_resume()
        except StoreError as error:
            self._recovery.expect_end(job.row.id, str(error))
            raise
        finally:
            self._job = None
            self._listeners.notify()

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` at every change; returns the function that ends this. A listener may not block."""
        return self._listeners.add(listener)

    def status(self, campaign: int) -> CampaignResponse | None:
        """Return the live picture of a campaign that runs here; None for any other."""
        job = self._job
        if job is None or job.row.id != campaign or job.progress is None:
            return None
        return answer_of(self._store.campaigns.get(campaign), job.progress, job.control.request)

    def stop_now(self, campaign: int | None, reason: str) -> bool:
        """Ask for the end of what runs, or of this campaign; returns whether it was asked, and waits for no lock."""
        job = self._job
        if job is None or campaign not in {None, job.row.id}:
            return False
        job.control.abort(reason)
        self._stop_requested = job.row.id
        log.warning("campaign.stop", campaign=job.row.id, bench=self._bench.name, reason=reason)
        threading.Thread(target=job.stop_if_stuck, name="stop", daemon=True).start()
        return True

    def abort(self, campaign: int, reason: str) -> CampaignResponse:
        """End the running campaign in the safe state; returns once it is there, or how far it is after a while."""
        job = self._job
        if job is not None and self.stop_now(campaign, reason) and job.thread is not None:
            job.thread.join(self.safe_within_s)
        self._stop_requested = None
        return self.status(campaign) or campaign_status(self._store, campaign)

    def describe(self) -> BenchDescription:
        """Return the bench and what it is doing."""
        unconfirmed = self._store.benches.unconfirmed(self._bench.name)
        job = self._job
        running, clock = (None, None) if job is None else (job.row.id, job.prepared.clock)
        return description(self._bench, running, unconfirmed, self._last_check, clock)

    @property
    def polls(self) -> tuple[int, int] | None:
        """The campaign that runs, and how often its engine has asked for requests; None while none runs."""
        job = self._job
        return None if job is None else (job.row.id, job.control.polls)

    def end_soon(self) -> None:
        """Begin nothing more, and let what runs go to its end in the safe state; returns at once."""
        self._stops = True
        if (job := self._job) is not None:
            job.control.abort(STOPS)

    def close(self) -> None:
        """End what runs, in the safe state, and let the bench go.

        Waits as long as that takes: a process that had the bench or the database before the table stands could drive it
        too. Every part of the safe state has an end of its own.
        """
        with ignore_signals():  # an impatient Ctrl-C must not leave the bench as it is
            self.end_soon()
            with self._guard:  # what is being begun is begun, and ended
                job = self._job
            if job is not None and job.thread is not None:
                job.thread.join()
            self.safe_state.close()
            if self._hold is not None:
                self._hold.close()
