"""Runs campaigns on one bench, one at a time, in a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.acting_user import actor
from labctl.answers.benches import BenchCheckResponse, BenchDescription
from labctl.answers.campaigns import CampaignRequest, CampaignResponse, ConfirmRequest, ResumeRequest
from labctl.errors import BenchBusy, Conflict, StoreError
from labctl.log import get_logger
from labctl.services.benches.check import checked, description
from labctl.services.benches.confirmation import SafeStateRetry
from labctl.services.benches.lease import BenchHold
from labctl.services.benches.start_confirmation import confirmation_text
from labctl.services.benches.stops import BenchStops
from labctl.services.campaigns.bench_lending import BenchLending
from labctl.services.campaigns.campaign_job import CampaignJob
from labctl.services.campaigns.listeners import ChangeListeners
from labctl.services.campaigns.live_loan import LiveLoan
from labctl.services.campaigns.preparation import Prepared, refuse_unconfirmed
from labctl.services.campaigns.recorded_campaigns import RecordedCampaigns
from labctl.services.campaigns.recovery import CampaignRecovery, secure_bench
from labctl.services.campaigns.resume import refuse_other_bench, with_original_simulation
from labctl.services.campaigns.status import answer_of, campaign_status, outlives_its_process
from labctl.services.campaigns.stop_execution import StopExecution
from labctl.services.campaigns.unattended import not_on_bench
from labctl.services.planning.loading import with_drivers
from labctl.services.simulation.hidden_effects import with_hidden_effects
from labctl.services.standards.agreement import with_register
from labctl.stop.latch import SERVICE_STOPS, StopRequest
from labctl.store import Store
from procedures.contracts.campaign_state import ENDED, UNFINISHED, CampaignState
from procedures.contracts.control import Control
from procedures.contracts.errors import StalePrompt
from procedures.contracts.operator import Answer, HumanOperator
from procedures.execution.signals import ignore_signals
from procedures.execution.stoppable_clock import stoppable
from procedures.monitoring.progress import Progress

log = get_logger()

#: How long an abort waits for the safe state before it returns how far the campaign is.
SAFE_WITHIN_S = 120.0


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
        wire_logs: Path | None = None,
    ) -> None:
        """Drive a bench; `wire_logs` is a folder for one log of each campaign. Raises BadInput for that folder."""
        self._store = store
        self._campaigns = RecordedCampaigns(store, wire_logs)
        self.safe_within_s = safe_within_s  #: how long an abort waits before it says how far it is
        self._hold = hold
        self._bench = bench
        self._make_clock = make_clock
        self._guard = threading.Lock()
        self._job: CampaignJob | None = None
        self.live = LiveLoan(bench.name)
        self._recovery = CampaignRecovery(store, bench, make_clock)
        self._stops = False
        self.stop_latch = BenchStops(store, bench.name)
        self.stops = StopExecution(
            self.stop_latch, self._recovery, self._guard, lambda: self._job, lambda: self._may_drive, self._secure_now
        )
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
        return not self.occupied and not self._stops and not self.stop_latch.state.held

    @property
    def occupied(self) -> bool:
        """Whether something runs or waits to be resumed, or another process drives the bench."""
        return self._job is not None or bool(self.live.serial) or self._recovery.pending or not self._may_drive

    @property
    def _may_drive(self) -> bool:
        return self._hold is None or self._hold.held

    def _is_idle(self) -> bool:
        return self._job is None and not self.live.serial and self._may_drive

    def lend(self, serial: str, end: Callable[[str], None], begin: Callable[[Clock], None]) -> None:
        """Lend the bench to a live calibration, which `begin` begins. Raises BenchBusy, and what `begin` raises."""
        with self._guard:
            self._refuse_unless_free()
            self.live.lend(serial, end, lambda: begin(self._make_clock()))

    def runs_or_was_stopped(self, campaign: int) -> bool:
        """Return whether a campaign runs, or was the last one asked to stop: its abort may not be recorded yet."""
        stop = self.stops.requested
        return (stop is not None and campaign == stop.campaign) or self.runs(campaign)

    def runs(self, campaign: int) -> bool:
        """Whether this campaign runs here now."""
        return self.running == campaign

    def start(self, request: CampaignRequest, *, attended: bool = True) -> CampaignResponse:
        """Plan, write down and begin a campaign; not `attended`: no person starts it now.

        Raises BenchBusy while another runs, without the lease on the bench, or while the bench is stopped;
        StartNotConfirmed where no person has confirmed that a real bench is clear, and whatever planning raises.
        """
        stop_known = self.stop_latch.state.known
        with self._guard:
            self._refuse_unless_free()
            bench = with_hidden_effects(self._bench, request.hide)
            refuse_unconfirmed(self._store, bench.name)
            clear = confirmation_text(bench, request)
            self._let_move(request.confirmed_by or actor().name if attended else None, stop_known)
            control = self._new_control()
            clock = stoppable(self._make_clock(), control)
            self._begin(prepared := self._campaigns.prepare(request, bench, clock, clear), control)
        return campaign_status(self._store, prepared.id)

    def _let_move(self, by: str | None, known: frozenset[str]) -> None:
        """Carry out the stops that are open, then let the bench move in a person's name. Raises BenchBusy.

        `known`: the stops that had been asked for when the person asked; a later one holds.
        """
        self.stops.carry_out()
        self.stop_latch.refuse_moving(by, known)

    def _new_control(self) -> Control:
        return Control() if self._hold is None else self._hold.control()

    def check(self) -> BenchCheckResponse:
        """Ask every instrument what it is and how it does; nothing moves. Raises BenchBusy while a campaign runs."""
        with self._guard:
            self._refuse_unless_free()
            bench = with_drivers(self._bench)
            answer = checked(bench, bench.name, self._make_clock())
            self._last_check = with_register(self._store, answer, bench)
            return self._last_check

    def _refuse_unless_free(self) -> None:
        if self._stops:
            raise BenchBusy(
                f"bench {self._bench.name}: {SERVICE_STOPS} and starts no campaign; start the service again first"
            )
        if self._job is not None:
            number = self._job.row.id
            raise BenchBusy(f"bench {self._bench.name} runs campaign {number} now; wait for its end, or abort it")
        self.live.refuse()
        self._recovery.record_end()
        if self._hold is not None:
            self._hold.check()

    def _begin(self, prepared: Prepared, control: Control) -> None:
        job = CampaignJob(self._store.campaigns.get(prepared.id), prepared, control, BenchLending())
        self._job = job
        self.used, self.stops.is_safe = True, False
        if self._stops:  # while the bench was being opened
            control.abort(SERVICE_STOPS)
        if stops := self.stop_latch.state.open:
            control.abort(stops[-1].reason)
        job.start(lambda: self._run(job, prepared))

    def resume(self, campaign: int, request: ResumeRequest, *, attended: bool = True) -> CampaignResponse:
        """Continue a paused campaign, or resume one that was interrupted, failed or aborted.

        Not `attended`: no person resumes it now. Raises BenchBusy while another runs, without the lease on the bench,
        or while the bench is stopped; Conflict when it is done, or when the bench waits to be inspected.
        """
        stop_known = self.stop_latch.state.known
        with self._guard:
            job = self._job
            if job is not None and job.row.id == campaign:
                if not job.control.request.pause:
                    raise Conflict(f"campaign {campaign} is running, so there is nothing to resume; let it run")
                job.control.resume(f"{request.reason or 'goes on'} ({request.by})")
            else:
                row = self._store.campaigns.get(campaign)
                refuse_other_bench(self._store, row, self._bench.name)
                self._refuse_unless_free()
                bench = with_original_simulation(row, self._bench)
                self._let_move(request.by if attended else None, stop_known)
                control = self._new_control()
                clock = stoppable(self._make_clock(), control)
                self._begin(self._campaigns.resume(campaign, bench, clock, request), control)
        return self.status(campaign) or campaign_status(self._store, campaign)

    def resume_unfinished(self) -> None:
        """Resume the campaign that was left unfinished on this bench; what prevents it becomes its reason.

        Without the lease nothing is changed: the process that has it by now may be resuming the campaign. A stop that
        an earlier process did not carry out is carried out first.
        """
        self._recovery.expect_resume()
        if not self._may_drive:
            return
        with self._guard:
            self.stops.carry_out()
        self._recovery.resume_newest(
            lambda number: self.resume(number, ResumeRequest(by="the service"), attended=False),
            self._secure,
            self.runs,
        )

    def _secure(self) -> None:
        with self._guard:
            if self._job is None:  # a campaign that a person has started meanwhile has the instruments
                self._secure_now()

    def _secure_now(self) -> str:
        """Make the bench safe, under the guard; returns what is not confirmed."""
        self.live.end("the bench was stopped")
        self.used = True
        problem = secure_bench(self._store, self._bench, self._make_clock())
        self.stops.is_safe = not problem
        return problem

    def resume_interrupted(self) -> None:
        """Once the bench may be driven again, resume the campaign that was interrupted when it was lost."""
        self._recovery.record_end()
        if self._recovery.has_unfinished and self._job is None and self._may_drive:
            self.resume_unfinished()

    def ask(self, campaign: int, change: Callable[[Control], None]) -> CampaignResponse:
        """Ask the running campaign for something, by its control. Raises Conflict when it does not run here."""
        change(self._running(campaign).control)
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
            raise not_on_bench(self._store, campaign, self._bench.name)
        return job

    def _run(self, job: CampaignJob, prepared: Prepared) -> None:
        def seen(progress: Progress) -> None:
            job.progress = progress
            self._listeners.notify()

        try:
            answer = self._campaigns.run(prepared, job.control, seen, job.lending)
            if answer.state is CampaignState.INTERRUPTED:
                self._recovery.expect_resume()
        except StoreError as error:
            self._recovery.expect_end(job.row.id, str(error), to_be_resumed=job.is_resumed_after(error))
            raise
        finally:
            job.control.leave_step()
            self.stops.is_safe = job.is_safe
            self._job = None
            self.stops.settle()
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

    def abort(self, campaign: int, stop: StopRequest) -> CampaignResponse:
        """End the running campaign in the safe state; returns once it is there, or how far it is after a while."""
        job = self._job
        if job is not None and job.row.id == campaign:
            if not job.control.request.abort:
                self.stops.request(stop)
            if job.thread is not None:
                job.thread.join(self.safe_within_s)
        self.stops.requested = None
        return self.status(campaign) or campaign_status(self._store, campaign)

    def stop_left(self, campaign: int, stop: StopRequest) -> CampaignResponse | None:
        """Stop a campaign that an earlier process left on this bench, before it is resumed; None where it is none."""
        row = self._store.campaigns.get(campaign)
        left_here = row.bench_name == self._bench.name and row.state in UNFINISHED and outlives_its_process(row)
        if not left_here or not self._may_drive:
            return None
        self.stops.request_left(stop).is_over(self.safe_within_s)
        answer = self.status(campaign) or campaign_status(self._store, campaign)
        return answer if answer.state in ENDED else answer.model_copy(update={"wish": "abort"})

    @property
    def is_at_rest(self) -> bool:
        """Whether no campaign runs, or the one that ends has brought the table to rest."""
        job = self._job
        return job is None or job.control.is_at_rest(0.0)

    @property
    def not_stopped(self) -> str:
        """What is known of a stop that is late: it was asked for some seconds ago, and the table is not at rest."""
        job = self._job
        if job is None or not job.control.request.abort or job.control.is_at_rest(0.0):
            return ""
        return self.stop_latch.late_text(job.control.hindrance)

    def note_unsupervised(self) -> None:
        """Interrupt what runs where its recipe says so: the supervisor is gone."""
        job = self._job
        if job is not None and job.prepared.plan.recipe.guards.unsupervised == "stop":
            job.control.interrupt("the service's supervisor is gone, and the recipe ends a campaign then")

    def stop_of(self, campaign: int) -> StopRequest | None:
        """Return the stop that was asked of a campaign last, here; None where none was."""
        stop = self.stops.requested
        return stop if stop is not None and stop.campaign == campaign else None

    def describe(self) -> BenchDescription:
        """Return the bench and what it is doing."""
        unconfirmed, job = self._store.benches.unconfirmed(self._bench.name), self._job
        ends = job is not None and job.control.request.abort
        hindrance = job.control.hindrance if job is not None and ends else ""
        if hindrance:
            unconfirmed = "; ".join(filter(None, (unconfirmed, f"stopping: {hindrance}")))
        running, clock = (None, None) if job is None else (job.row.id, job.prepared.clock)
        bench_answer = description(self._bench, running, unconfirmed, self._last_check, clock)
        stop = self.stop_latch.describe(hindrance, stopping=ends)
        return bench_answer.model_copy(update={"stop": stop, "live": self.live.serial})

    @property
    def polls(self) -> tuple[int, int] | None:
        """The campaign that runs, and how often its engine has asked for requests; None while none runs."""
        job = self._job
        return None if job is None else (job.row.id, job.control.polls)

    def end_soon(self) -> None:
        """Begin nothing more, and let what runs go to its end in the safe state; returns at once."""
        self._stops = True
        if (job := self._job) is not None:
            job.control.abort(SERVICE_STOPS)

    def close(self) -> None:
        """End what runs, in the safe state, and let the bench go.

        Waits as long as that takes: a process that had the bench or the database before the table stands could drive it
        too. Every part of the safe state has an end of its own.
        """
        with ignore_signals():  # an impatient Ctrl-C must not leave the bench as it is
            self.end_soon()
            self.stops.end_soon()
            with self._guard:  # what is being begun is begun, and ended
                job = self._job
            if job is not None and job.thread is not None:
                job.thread.join()
            self.safe_state.close()
            self.stops.close()
            if self._hold is not None:
                self._hold.close()
