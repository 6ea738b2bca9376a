"""Carries out the steps of a plan one at a time, marks each in the journal and recovers from what the recipe allows."""

from __future__ import annotations

from dataclasses import dataclass

from instruments.errors import InstrumentError, LinkError, MalformedReply, NoReply
from procedures.contracts.errors import Aborted, GuardTripped, ProcedureError, StepFailed, Unanswered
from procedures.contracts.journal import Event
from procedures.contracts.steps import (
    Acquire,
    Home,
    MeasureClock,
    Mount,
    MoveChamber,
    Rest,
    SafeState,
    SetSupply,
    Soak,
    Step,
    StepResult,
    Turn,
)
from procedures.execution.context import POLL_S, ExecutionContext, raise_violation
from procedures.execution.step_handlers import HANDLERS, Figures
from procedures.execution.waiting import checkpoint, hold, pass_time, suspend
from procedures.monitoring.event_recorder import warning
from procedures.planning.plan import Plan
from procedures.recipe.rules import WAITED_FOR

PAUSES_S = (1.0, 2.0, 4.0, 8.0, 16.0)
STANDSTILL_S = 60.0
#: Steps that can be begun again without asking a person anew; a turn by hand asks anyway.
REPEATABLE = (Home, MeasureClock, MoveChamber, Soak, SetSupply, Acquire, Turn, Rest)


def is_reconnectable(context: ExecutionContext, step: Step, error: LinkError) -> bool:
    """Return whether a step may be begun again once its instrument answers.

    A table that is silent or sends malformed replies in the middle of a move may have lost steps or time, and a person
    has to inspect it; a table whose port went away and came back is homed.
    """
    if not isinstance(step, REPEATABLE):
        return False
    return error.device != context.bench.table_name or not isinstance(error, NoReply | MalformedReply)


def reconnect(context: ExecutionContext, error: LinkError) -> None:
    """Wait, with the table at rest, until an instrument answers again.

    Raises the error when it stays silent, GuardTripped, and InstrumentError for a table that cannot be stopped.
    """
    device = error.device
    if device != context.bench.table_name:
        context.bench.stop_table()  # an earlier move may still run, and a controller refuses another one meanwhile
    context.monitor.links.change(device, "degraded", f"{error}; trying again at most {len(PAUSES_S)} times")
    for attempt, pause_s in enumerate(PAUSES_S, start=1):
        pass_time(context, pause_s, pausing=False)
        violations = context.without_dropouts(context.monitor.poll(POLL_S))
        # a violation that suspends is found again when the step begins
        raise_violation([violation for violation in violations if violation.action == "fail"])
        try:
            _reach(context, device)
        except InstrumentError as silent:
            text = f"attempt {attempt} of {len(PAUSES_S)} failed: {silent}"
            context.recorder.event(Event("link.retry", text, level="warning", device=device))
            continue
        context.monitor.links.change(device, "well")
        return
    context.monitor.links.change(
        device, "lost", f"{error}; the instrument was not reached again in {len(PAUSES_S)} tries"
    )
    raise error


def _reach(context: ExecutionContext, device: str) -> None:
    bench = context.bench
    if device == bench.table_name:
        bench.table.stop()
        until_s = context.clock.now_s() + STANDSTILL_S
        while bench.table.is_moving() and context.clock.now_s() < until_s:
            pass_time(context, 1.0, pausing=False)
        bench.table.home()
    elif device == bench.chamber_name:
        bench.chamber.read()
    elif device in bench.references:
        bench.references[device].read()
    elif device in bench.gyros:
        bench.gyros[device].stop()
        bench.gyros[device].start()
        bench.gyros[device].read_latest()


@dataclass
class Recovery:
    """The recoveries of one step, counted."""

    context: ExecutionContext
    step: Step
    suspensions: int = 0
    reconnections: int = 0

    def applies(self, error: BaseException) -> bool:
        """Return whether the step is begun again, or left out, after this error."""
        return self.by_suspension(error) or self.by_reconnection(error) or self.by_skipping(error)

    def by_suspension(self, error: BaseException) -> bool:
        """Return whether the step is begun again once the limits hold."""
        may = self.suspensions < self.context.recipe.guards.max_suspensions
        return isinstance(error, GuardTripped) and error.action in WAITED_FOR and may

    def by_reconnection(self, error: BaseException) -> bool:
        """Return whether the step is begun again once a silent instrument answers."""
        may = self.reconnections + 1 < self.context.recipe.on_failure.link_attempts
        return isinstance(error, LinkError) and may and is_reconnectable(self.context, self.step, error)

    def by_skipping(self, error: BaseException) -> bool:
        """Return whether the step is a mounting that is left out because the question was not answered in time."""
        may = self.context.recipe.on_failure.operator_timeout == "skip"
        return isinstance(error, Unanswered) and isinstance(self.step, Mount) and may


def _is_fitted(step: Step) -> bool:
    return isinstance(step, Acquire) and not step.verification


class StepExecutor:
    """Runs single steps of one plan in one context."""

    def __init__(self, plan: Plan, context: ExecutionContext) -> None:
        self._plan = plan
        self._context = context
        self._recorder = context.recorder
        self._not_needed_because = ""
        self.skipped: set[int] = set()  #: steps that are left out
        self.not_needed: set[int] = set()  #: those of them that are left out because enough is measured
        self.bench_is_safe = False  #: whether the last step left the bench in its safe state

    def skip_mounting(self, index: int) -> None:
        """Leave out mounting `index` and every step that makes no sense without it."""
        self.skipped |= {index, *self._plan.left_out_with(index)}

    def note_skipped(self, skipped: frozenset[int]) -> None:
        """Note steps that were left out before an interruption: those of no mounting were not needed."""
        self.not_needed = set(skipped) - self.skipped
        self.skipped |= self.not_needed

    def skip_fitted_after(self, index: int, why: str) -> bool:
        """Leave out all steps after `index` up to the last data set that is fitted; returns whether there are any.

        What follows them is done: data sets that verify, the checks of the table, and the safe state.
        """
        steps = self._plan.steps
        fitted = [n for n in range(index + 1, len(steps)) if _is_fitted(steps[n]) and n not in self.skipped]
        if not fitted:
            return False
        self._not_needed_because = why
        self.not_needed |= set(range(index + 1, fitted[-1] + 1)) - self.skipped
        self.skipped |= self.not_needed
        return True

    def run(self, index: int) -> None:
        """Run step `index` to its end; it is begun again after each recovery.

        Raises what the step raises once the recipe allows no further recovery.
        """
        if index in self.skipped:
            is_enough = index in self.not_needed
            self._record_skipped(index, self._not_needed_because if is_enough else "the units were not turned")
            return
        recovery = Recovery(self._context, self._plan.steps[index])
        while index not in self.skipped:
            try:
                self._attempt(index, recovery)
                return
            except (GuardTripped, LinkError, Unanswered) as error:
                if not self._recover(index, recovery, error):
                    raise

    def carry_out(self, step: Step) -> Figures:
        """Carry out a step without a mark in the journal; returns the figures that say how it went.

        A request to end is obeyed before: nothing begins to move after a stop. Raises Aborted, Interrupted.
        """
        if not isinstance(step, SafeState):
            checkpoint(self._context)
        self.bench_is_safe = False
        figures = HANDLERS[step.kind](self._context, step)
        self.bench_is_safe = isinstance(step, SafeState)
        return figures

    def _attempt(self, index: int, recovery: Recovery) -> None:
        """Run one step once and record how it ended."""
        self._prepare(self._plan.steps[index])
        self._recorder.step_started(index)
        try:
            figures = self.carry_out(self._plan.steps[index])
        except BaseException as error:
            self._record_unfinished(index, recovery, error)
            raise
        self._recorder.step_ended(index, StepResult(outcome="done", figures=figures))

    def _prepare(self, step: Step) -> None:
        """Act on a request to pause or abort; before a data set, repeat a soak that is owed."""
        context = self._context
        checkpoint(context)
        with context.owing_soak():
            hold(context)
        owed = context.owed_soak
        if owed is not None and isinstance(step, Acquire):
            self._recorder.event(
                warning(
                    "soak_again",
                    f"soaking again: the air has left {owed.temperature_c:g} deg C, or the temperature of the "
                    "unit is uncertain",
                )
            )
            self.carry_out(owed)
            self._recorder.event(Event("soaked_again", f"the soak at {owed.temperature_c:g} deg C is done again"))
        context.owed_soak = None

    def _recover(self, index: int, recovery: Recovery, error: GuardTripped | LinkError | Unanswered) -> bool:
        """Do what the recipe says about a failed step; returns False where it says nothing.

        Raises InstrumentError or ProcedureError when the recovery fails.
        """
        if isinstance(error, GuardTripped) and recovery.by_suspension(error):
            recovery.suspensions += 1
            suspend(self._context, error)
            return True
        if isinstance(error, LinkError) and recovery.by_reconnection(error):
            recovery.reconnections += 1
            self._reconnect(index, error)
            return True
        if recovery.by_skipping(error):
            self._record_skipped(index, str(error))
            self.skip_mounting(index)
            return True
        return False

    def _reconnect(self, index: int, error: LinkError) -> None:
        try:
            with self._context.owing_soak(), self._context.monitor.listening(self._context.notice_leaving):
                reconnect(self._context, error)
        except (InstrumentError, ProcedureError) as lost:
            self._recorder.step_ended(index, StepResult(outcome="failed", reason=str(lost)))
            raise

    def _record_skipped(self, index: int, reason: str) -> None:
        self._recorder.step_started(index)
        self._recorder.step_ended(index, StepResult(outcome="skipped", reason=reason))

    def _record_unfinished(self, index: int, recovery: Recovery, error: BaseException) -> None:
        figures = error.figures if isinstance(error, StepFailed) else {}
        stopped = isinstance(error, Aborted | KeyboardInterrupt | SystemExit) or recovery.applies(error)
        reason = str(error) or type(error).__name__
        outcome = "interrupted" if stopped else "failed"
        self._recorder.step_ended(index, StepResult(outcome=outcome, reason=reason, figures=figures))
