"""Runs a plan step by step, marks each in the journal, pauses, suspends, aborts, and always ends in the safe state."""

from __future__ import annotations

from dataclasses import dataclass

from instruments.clock import Clock
from instruments.errors import InstrumentError, LinkError
from procedures.execution.active_bench import ActiveBench
from procedures.contracts.bench import Bench
from procedures.contracts.control import Control
from procedures.contracts.errors import Aborted, GuardTripped, Interrupted, ProcedureError, StepFailed, Unanswered
from procedures.contracts.journal import NOT_SAFE, CampaignState, Event, Journal
from procedures.contracts.operator import Operator
from procedures.contracts.steps import Acquire, Mount, SafeState, Soak, Step, StepResult
from procedures.execution.context import LOOK_S, ExecutionContext
from procedures.execution.reconnect import is_reconnectable, reconnect
from procedures.execution.resume import Restart, take_up
from procedures.execution.safe_state import make_safe
from procedures.execution.signals import ignore_signals
from procedures.execution.step_handlers import HANDLERS, Figures
from procedures.monitoring.guards import Guards
from procedures.monitoring.monitor import BenchMonitor
from procedures.monitoring.progress import Observer, Progress, ProgressTracker
from procedures.monitoring.recorder import CampaignRecorder, warning
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan


@dataclass(frozen=True)
class Outcome:
    """How a campaign ended, and why."""

    state: CampaignState
    reason: str
    safe: bool  #: whether every part of the safe state was confirmed


class Engine:
    """One run of a plan on a bench.

    `run` blocks until the campaign is over; `control` and `progress` are for other threads. Journal times are clock
    seconds since `start_s` (default: the clock's time when `run` is called). Without `guards` the recipe's own rules
    are held against the limits of the bench.
    """

    def __init__(
        self,
        plan: Plan,
        bench: Bench,
        journal: Journal,
        clock: Clock,
        operator: Operator,
        guards: Guards | None = None,
        control: Control | None = None,
        *,
        observer: Observer | None = None,
        start_s: float | None = None,
    ) -> None:
        self.plan = plan
        self.control = control or Control()
        self._board = ProgressTracker(plan, clock, observer)
        self._log = CampaignRecorder(journal, clock, self._board, clock.now_s() if start_s is None else start_s)
        self._start_is_now = start_s is None
        self.complaints: tuple[str, ...] = ()  #: what the last safe state could not confirm
        self._whole = bench
        self._crew = ActiveBench.of(bench)
        guards = guards or Guards(
            plan.recipe.guards, lambda: BenchLimits.of(bench), bench.chamber.name, bench.table.name
        )
        watch = BenchMonitor(self._crew, guards, self._log)
        self._stage = ExecutionContext(plan.recipe, self._crew, bench, clock, operator, self.control, self._log, watch)
        self._safe = False
        self._left_out: set[int] = set()  #: steps that an unanswered mounting takes with it
        self._owed: Soak | None = None  #: to be done again before the next data set
        self._suspensions = self._silences = 0  #: of the present step

    @property
    def progress(self) -> Progress:
        """Where the campaign is; readable from any thread."""
        return self._board.progress

    def run(self, start_at: int = 0, restart: Restart | None = None) -> Outcome:
        """Run the plan from step `start_at` (from 0) to its end; `restart` says what is known of an interruption.

        What the bench, a guard or a person ends is an Outcome. Anything else (a failing journal, Ctrl-C, a mistake in
        the program) is raised again once the bench is safe.
        """
        if self._start_is_now:
            self._log.start_s = self._stage.clock.now_s()
        state, reason = CampaignState.FAILED, "ended by an error of the program"
        try:
            self._begin(start_at, restart)
            for index in range(start_at, len(self.plan.steps)):
                self._run_step(index)
            state, reason = CampaignState.DONE, self._all_done()
        except Interrupted as error:
            state, reason = CampaignState.INTERRUPTED, f"interrupted: {error}"
        except Aborted as error:
            state, reason = CampaignState.ABORTED, f"aborted: {error}"
        except (InstrumentError, ProcedureError) as error:
            reason = str(error)
        except (KeyboardInterrupt, SystemExit):
            state, reason = CampaignState.ABORTED, "interrupted (Ctrl-C or a signal)"
            raise
        except BaseException as error:
            reason = f"{type(error).__name__}: {error}"
            raise
        finally:
            outcome = self._ended(state, reason)
        return outcome

    def _begin(self, start_at: int, restart: Restart | None) -> None:
        """Say that the campaign runs; after an interruption, first make the bench safe and what that step relies on."""
        if start_at == 0 and restart is None:
            self._log.change_state(CampaignState.RUNNING, "started")
            self._stage.watch.begin()
            self._stage.look(read_latest=False)
            return
        restart = restart or Restart()
        for name in restart.dropped.keys() & self._crew.gyros.keys():
            self._crew.drop(name, restart.dropped[name])
        self._log.board.update(dropped=dict(self._crew.dropped))
        for index in restart.skipped:
            if isinstance(self.plan.steps[index], Mount):
                self._left_out |= {index, *self.plan.left_out_with(index)}
        self._stage.added_runs = restart.added_runs
        self._log.change_state(CampaignState.RUNNING, f"taken up at step {start_at + 1}")
        take_up(self._stage, self.plan, start_at, restart, self._carry_out)

    def _all_done(self) -> str:
        gone = [f"{name} dropped out ({reason})" for name, reason in self._crew.dropped.items()]
        left = [f"{len(self._left_out)} steps were left out as nobody turned the units"] if self._left_out else []
        return "; ".join(["all steps done", *left, *gone])

    def _run_step(self, index: int) -> None:
        """Run one step to its end, again after every suspension and once a silent instrument answers again."""
        if index in self._left_out:
            self._leave_out(index, "nobody turned the units")
            return
        self._suspensions = self._silences = 0
        while index not in self._left_out:
            try:
                self._attempt(index)
                return
            except (GuardTripped, LinkError, Unanswered) as error:
                if not self._relieved(index, error):
                    raise

    def _relieved(self, index: int, error: GuardTripped | LinkError | Unanswered) -> bool:
        """Do what the recipe says about what stopped a step; False where that is nothing. Raises when it is in vain."""
        if isinstance(error, GuardTripped) and self._suspends(error):
            self._suspend(error)
            return True
        if isinstance(error, LinkError) and self._mends(index, error):
            self._silences += 1
            try:
                self._mend(error)
            except (InstrumentError, ProcedureError) as lost:
                self._log.step_ended(index, StepResult(outcome="failed", reason=str(lost)))
                raise
            return True
        if isinstance(error, Unanswered) and self._leaves_out(index):
            self._leave_out(index, str(error))
            self._left_out |= {index, *self.plan.left_out_with(index)}
            return True
        return False

    def _suspends(self, error: BaseException) -> bool:
        """Return whether a step is waited with, and begun again."""
        may = self._suspensions < self.plan.recipe.guards.max_suspensions
        return isinstance(error, GuardTripped) and error.action == "suspend" and may

    def _mends(self, index: int, error: BaseException) -> bool:
        """Return whether a step is begun again once a silent instrument answers."""
        may = self._silences + 1 < self.plan.recipe.on_failure.link_attempts
        return isinstance(error, LinkError) and may and is_reconnectable(self._stage, self.plan.steps[index], error)

    def _leaves_out(self, index: int) -> bool:
        """Return whether a mounting that nobody does is left out."""
        return isinstance(self.plan.steps[index], Mount) and self.plan.recipe.on_failure.operator_timeout == "skip"

    def _leave_out(self, index: int, reason: str) -> None:
        self._log.step_started(index)
        self._log.step_ended(index, StepResult(outcome="skipped", reason=reason))

    def _attempt(self, index: int) -> None:
        """Run one step once and mark how it went."""
        self._between_steps(self.plan.steps[index])
        self._log.step_started(index)
        try:
            figures = self._carry_out(self.plan.steps[index])
        except BaseException as error:
            self._mark_unfinished(index, error)
            raise
        self._log.step_ended(index, StepResult(outcome="done", figures=figures))

    def _carry_out(self, step: Step) -> Figures:
        self._safe = False
        figures = HANDLERS[step.kind](self._stage, step)
        self._safe = isinstance(step, SafeState)
        return figures

    def _mark_unfinished(self, index: int, error: BaseException) -> None:
        figures = error.figures if isinstance(error, StepFailed) else {}
        stopped = isinstance(error, Aborted | KeyboardInterrupt | SystemExit)
        stopped = stopped or self._suspends(error) or self._mends(index, error)
        stopped = stopped or (isinstance(error, Unanswered) and self._leaves_out(index))
        reason = str(error) or type(error).__name__
        outcome = "interrupted" if stopped else "failed"
        result = StepResult(outcome=outcome, reason=reason, figures=figures)
        self._log.step_ended(index, result)

    def _between_steps(self, coming: Step) -> None:
        """Obey a wish to pause or abort; before a data set, soak again at a temperature that was left meanwhile."""
        stage = self._stage
        stage.checkpoint()
        soaked = stage.soaked
        stage.hold()
        if soaked is not None and stage.soaked is None:
            self._owed = soaked
        if self._owed is not None and isinstance(coming, Acquire):
            self._log.event(
                warning("soak_again", f"soaked again: {self._owed.temperature_c:g} deg C was left or in doubt")
            )
            self._carry_out(self._owed)
            self._log.event(Event("soaked_again", f"the soak at {self._owed.temperature_c:g} deg C is done again"))
        self._owed = None

    def _mend(self, error: LinkError) -> None:
        """Reach an instrument again; a soak is owed if the air left its band meanwhile."""
        soaked = self._stage.soaked
        with self._stage.watch.telling(self._stage.notice_leaving):
            reconnect(self._stage, error)
        if soaked is not None and self._stage.soaked is None:
            self._owed = soaked

    def _suspend(self, trip: GuardTripped) -> None:
        """Wait at rest until every limit has held for a while; a soak is owed then.

        Raises StepFailed when that takes too long.
        """
        stage, rules = self._stage, self.plan.recipe.guards
        self._suspensions += 1
        self._owed, stage.soaked = stage.soaked or self._owed, None
        stage.bench.table.stop()
        self._log.event(Event("soak_owed", f"suspended: {trip}"))
        self._log.change_state(CampaignState.PAUSED, f"suspended: {trip}")
        began_s = clear_since_s = stage.clock.now_s()
        while stage.clock.now_s() - clear_since_s < rules.release_s:
            stage.pass_time(LOOK_S, pausing=False)
            trips = stage.without_dropouts(stage.watch.look(LOOK_S))
            if any(each.action == "fail" for each in trips):
                raise StepFailed(f"while suspended: {trips[0].message}")
            if any(each.action == "suspend" for each in trips):
                clear_since_s = stage.clock.now_s()
            if stage.clock.now_s() - began_s >= rules.suspend_timeout_s:
                raise StepFailed(f"suspended for {rules.suspend_timeout_s:g} s without relief: {trip}")
        self._log.change_state(CampaignState.RUNNING, "the limits hold again")

    def _ended(self, state: CampaignState, reason: str) -> Outcome:
        """End the campaign, whoever interrupts; what was interrupted before the shield was up is begun again."""
        while True:
            try:
                with ignore_signals(self._hold_on):
                    return self._end(state, reason)
            except KeyboardInterrupt:
                continue

    def _hold_on(self, _signal: int) -> None:
        self._log.board.update(last_event="the bench is being made safe; this ends by itself")

    def _end(self, state: CampaignState, reason: str) -> Outcome:
        """Make the bench safe whatever happened, and say how the campaign ended."""
        if not self._safe:
            self._log.board.update(step_text="making the bench safe")
        complaints = () if self._safe else make_safe(self._whole, self._stage.clock)
        self.complaints = complaints
        if complaints:
            text = NOT_SAFE + "; ".join(complaints)
            reason = f"{reason}. {text}"
            state = CampaignState.FAILED if state is CampaignState.DONE else state
            self._log.event(Event("safe_state", text, level="error"))
        self._log.change_state(state, reason)
        return Outcome(state, reason, safe=not complaints)
