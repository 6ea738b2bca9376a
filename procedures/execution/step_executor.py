"""Carries out the steps of a plan one at a time, marks each in the journal and recovers from what the recipe allows."""

from __future__ import annotations

from instruments.errors import InstrumentError, LinkError
from procedures.contracts.errors import Aborted, GuardTripped, ProcedureError, StepFailed, Unanswered
from procedures.contracts.journal import Event
from procedures.contracts.steps import Acquire, SafeState, Step, StepResult
from procedures.execution.context import ExecutionContext
from procedures.execution.reconnect import reconnect
from procedures.execution.step_handlers import HANDLERS, Figures
from procedures.execution.step_recovery import Recovery
from procedures.execution.waiting import checkpoint, hold, suspend
from procedures.monitoring.event_recorder import warning
from procedures.planning.plan import Plan


class StepExecutor:
    """Runs single steps of one plan in one context."""

    def __init__(self, plan: Plan, context: ExecutionContext) -> None:
        self._plan = plan
        self._context = context
        self._recorder = context.recorder
        self.skipped: set[int] = set()  #: mountings that were not done, with the steps that depend on them
        self.bench_is_safe = False  #: whether the last step left the bench in its safe state

    def skip_mounting(self, index: int) -> None:
        """Leave out mounting `index` and every step that makes no sense without it."""
        self.skipped |= {index, *self._plan.left_out_with(index)}

    def run(self, index: int) -> None:
        """Run step `index` to its end; it is begun again after each recovery.

        Raises what the step raises once the recipe allows no further recovery.
        """
        if index in self.skipped:
            self._record_skipped(index, "the units were not turned")
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
        """Obey a request to pause or abort; before a data set, repeat a soak that is owed."""
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
