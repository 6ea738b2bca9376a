"""Runs a plan step by step on a bench and always ends in the safe state."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from instruments.clock import Clock
from instruments.errors import InstrumentError
from procedures.contracts.bench import Bench
from procedures.contracts.campaign_state import CampaignState
from procedures.contracts.control import Control
from procedures.contracts.errors import Aborted, Interrupted, ProcedureError
from procedures.contracts.journal import Event, Journal
from procedures.contracts.operator import Operator
from procedures.contracts.steps import Acquire, Mount
from procedures.contracts.sufficiency import SufficiencyMonitor
from procedures.execution.active_bench import ActiveBench
from procedures.execution.context import ExecutionContext
from procedures.execution.resume import Restart, resume_campaign
from procedures.execution.shutdown import Outcome, Shutdown
from procedures.execution.step_executor import StepExecutor
from procedures.monitoring.campaign_time import CampaignTime
from procedures.monitoring.event_recorder import CampaignRecorder
from procedures.monitoring.guards import Guards
from procedures.monitoring.monitor import BenchMonitor
from procedures.monitoring.progress import Observer, Progress, ProgressTracker
from procedures.planning.limits import BenchLimits
from procedures.planning.plan import Plan


class Engine:
    """One run of a plan on a bench.

    `run` blocks until the campaign is over; `control` and `progress` are for other threads. Journal times are
    campaign time: that of `time` for a resumed campaign, else seconds since `run` was called. Without `guards` the
    recipe's own rules are compared with the limits of the bench. `notices` are recorded as the campaign starts.
    `sufficiency` is asked after each data set whether the campaign may end before its plan does; None: it does not.
    `passing` are errors of the journal that pass by themselves: they interrupt the campaign, to be resumed later.
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
        time: CampaignTime | None = None,
        notices: Sequence[Event] = (),
        sufficiency: SufficiencyMonitor | None = None,
        passing: tuple[type[Exception], ...] = (),
    ) -> None:
        self.plan = plan
        self._sufficiency = sufficiency
        self._enough = ""
        self._notices, self._passing = notices, passing
        self.control = control or Control()
        self._tracker = ProgressTracker(plan, clock, observer)
        self._recorder = CampaignRecorder(journal, clock, self._tracker, time or CampaignTime(clock))
        active = ActiveBench.of(bench)
        guards = guards or Guards(
            plan.recipe.guards, lambda: BenchLimits.of(bench), active.chamber_name, active.table_name
        )
        monitor = BenchMonitor(active, guards, self._recorder)
        self._context = ExecutionContext(
            plan.recipe, active, bench, clock, operator, self.control, self._recorder, monitor
        )
        self._executor = StepExecutor(plan, self._context)
        self._shutdown = Shutdown(self._context)

    @property
    def progress(self) -> Progress:
        """Where the campaign is; readable from any thread."""
        return self._tracker.progress

    @property
    def complaints(self) -> tuple[str, ...]:
        """What the last safe state could not confirm."""
        return self._shutdown.complaints

    def run(
        self,
        start_at: int = 0,
        restart: Restart | None = None,
        on_ending: Callable[[], None] = lambda: None,
    ) -> Outcome:
        """Run the plan from step `start_at` (from 0) to its end; `restart` says what is known of an interruption.

        `on_ending` is called before the bench is made safe, again where a signal cut that short. What the bench, a
        guard or a person ends is an Outcome. Anything else (a failing journal, Ctrl-C, a mistake in the program) is
        raised again once the bench is safe.
        """
        self._recorder.time.begin()
        state, reason = CampaignState.FAILED, "ended by an error of the program"
        try:
            with self._context.monitor.stalls.watching():
                self._begin(start_at, restart)
                for index in range(start_at, len(self.plan.steps)):
                    self._executor.run(index)
                    if isinstance(self.plan.steps[index], Acquire):
                        self._end_where_enough(index)
            state, reason = CampaignState.DONE, self._describe_done()
        except Interrupted as error:
            state, reason = CampaignState.INTERRUPTED, f"interrupted: {error}"
        except Aborted as error:
            state, reason = CampaignState.ABORTED, f"aborted: {error}"
        except (InstrumentError, ProcedureError) as error:
            state, reason = self._failed(error)
        except (KeyboardInterrupt, SystemExit):
            state, reason = CampaignState.ABORTED, "interrupted (Ctrl-C or a signal)"
            raise
        except self._passing as error:
            state, reason = CampaignState.INTERRUPTED, f"interrupted: {error}"
            raise
        except BaseException as error:
            reason = f"{type(error).__name__}: {error}"
            raise
        finally:
            outcome = self._shutdown.end(state, reason, on_ending, bench_is_safe=self._executor.bench_is_safe)
        return outcome

    def close(self) -> None:
        """Release what watches over the uncertainty; the bench stays open."""
        if self._sufficiency is not None:
            self._sufficiency.close()

    def _begin(self, start_at: int, restart: Restart | None) -> None:
        """Record that the campaign runs, then check the bench; after an interruption, prepare the bench first."""
        if start_at > 0 or restart is not None:
            self._resume(start_at, restart or Restart())
            return
        self._recorder.change_state(CampaignState.RUNNING, "started")
        for notice in self._notices:
            self._recorder.event(notice)
        self._context.monitor.begin()
        self._context.poll(read_latest=False)

    def _resume(self, start_at: int, restart: Restart) -> None:
        """Restore what is known of the interrupted campaign, then make the bench what step `start_at` relies on."""
        bench = self._context.bench
        for name in restart.dropped.keys() & bench.gyros.keys():
            bench.drop(name, restart.dropped[name])
        self._tracker.update(dropped=dict(bench.dropped))
        for index in restart.skipped:
            if isinstance(self.plan.steps[index], Mount):
                self._executor.skip_mounting(index)
        self._executor.note_skipped(restart.skipped)
        self._context.added_runs = restart.added_runs
        self._context.clock_runs = [
            run for run in restart.clock_runs if run.used
        ]  # others disagreed, or were interrupted
        self._context.clock_session = 1 + max((run.session for run in restart.clock_runs), default=0)
        self._recorder.change_state(CampaignState.RUNNING, f"resumed at step {start_at + 1}")
        resume_campaign(self._context, self.plan, start_at, restart, self._executor.carry_out)

    def _end_where_enough(self, index: int) -> None:
        """After the data set of step `index`, skip the others that are fitted where enough is measured."""
        if self._sufficiency is None or self._enough or index in self._executor.not_needed:
            return
        answer = self._sufficiency.ask()
        for event in answer.events:
            self._recorder.event(event)
        if answer.enough and self._executor.skip_fitted_after(index, answer.enough):
            self._enough = answer.enough
            self._recorder.event(Event("enough", f"{answer.enough}; the data sets that are left are skipped"))

    def _concluded(self) -> list[str]:
        """Return what all data sets say of the uncertainty that the campaign was to reach."""
        if self._sufficiency is None:
            return []
        answer = self._sufficiency.conclude(self._enough)
        for event in answer.events:
            self._recorder.event(event)
        return [answer.enough] if answer.enough else []

    def _failed(self, error: InstrumentError | ProcedureError) -> tuple[CampaignState, str]:
        """Return how a step ends that fails. One that fails after a request to end has been stopped by another thread.

        The engine may find the table at rest before it sees the request: it waited for its database meanwhile.
        """
        request = self.control.request
        if not request.abort:
            return CampaignState.FAILED, str(error)
        state = CampaignState.INTERRUPTED if request.resumable else CampaignState.ABORTED
        return state, f"{state}: {request.reason} (the step then ended with: {error})"

    def _describe_done(self) -> str:
        executor, dropped = self._executor, self._context.bench.dropped
        not_needed = len(executor.not_needed)
        skipped = len(executor.skipped - executor.not_needed)
        left_out = [f"{skipped} steps were left out because the units were not turned"] if skipped else []
        gone = [f"{name} was excluded ({reason})" for name, reason in dropped.items()]
        done = f"{not_needed} steps were skipped, because they are not needed" if not_needed else "all steps done"
        return "; ".join([*self._concluded(), done, *left_out, *gone])
