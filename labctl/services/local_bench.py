"""The bench of a service that drives it in its own process: its runner, its schedule, and the control over both."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.acting_user import ITSELF, acting, actor
from labctl.answers.benches import BenchDescription, StopResponse
from labctl.answers.campaigns import CampaignResponse
from labctl.answers.live import LiveHistoryResponse, LiveStateResponse
from labctl.errors import Conflict, NotStopped, StoreError
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.benches.confirmation import describe_bench, describe_safe_state
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.stop_requests import StopElsewhere
from labctl.services.commands.service_control import WITHOUT_BENCH, ServiceControl
from labctl.services.live.live_sessions import LiveSessions
from labctl.services.schedule.scheduler import REAL_BENCH_LATE_LIMIT_S, Scheduler
from labctl.stop.client import not_stopped_text
from labctl.stop.latch import StopRequest
from labctl.stop.page import BenchNow
from labctl.stop.wire import Stopping
from labctl.store import Store
from labctl.texts import NO_BENCH

#: A stop of the whole bench is answered within this, s.
STOP_S = 4.5


class LocalBench:
    """Drives a bench, or none, and its schedule."""

    heard_s = 0.0

    def __init__(self, store: Store, clock: Clock, runner: BenchRunner | None) -> None:
        self._store = store
        self.runner = runner
        self.scheduler = None if runner is None else _scheduler(store, clock, runner)
        self.live = LiveSessions(store, clock, runner)
        self.control = ServiceControl(runner, self.live)
        self.stops = False

    @property
    def bench(self) -> BenchFile | None:
        """The bench, where there is one."""
        return None if self.runner is None else self.runner.bench

    @property
    def running(self) -> int | None:
        """The campaign that runs now."""
        return None if self.runner is None else self.runner.running

    @property
    def schedule_trouble(self) -> str:
        """Why the schedule could not be read; empty when all is well."""
        return "" if self.scheduler is None else self.scheduler.trouble

    def runs(self, campaign: int) -> bool:
        """Whether this campaign runs here now."""
        return self.runner is not None and self.runner.runs(campaign)

    def status(self, campaign: int) -> CampaignResponse | None:
        """Return the live picture of a campaign that runs here; None for any other."""
        return None if self.runner is None else self.runner.status(campaign)

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call `listener` at every change; returns the function that ends this. A listener may not block."""
        ends = [self.live.listen(listener)]
        if self.runner is not None:
            ends.append(self.runner.listen(listener))

        def end() -> None:
            for each in ends:
                each()

        return end

    def live_state(self, *, watched: bool = False) -> LiveStateResponse:
        """Return the live calibration that runs, or the last; `watched`: a page follows it."""
        return self.live.state(watched=watched)

    def live_history(self) -> LiveHistoryResponse:
        """Return how U fell in it, fit by fit."""
        return self.live.history()

    def describe(self) -> BenchDescription | None:
        """Return the bench and what it is doing; None without a bench."""
        return None if self.runner is None else self.runner.describe()

    def start(self) -> None:
        """Resume the campaign that an earlier process left on this bench, safe state first; then start the schedule.

        What is due waits for that campaign.
        """
        with acting(ITSELF):  # no request asked for it
            if self.runner is not None:
                self.runner.stops.watch()
                self.runner.safe_state.start()
                if self.scheduler is not None:
                    with suppress(StoreError):  # read again with the schedule
                        self.scheduler.read_the_past()
                self.runner.resume_unfinished()
            if self.scheduler is not None:
                self.scheduler.start()

    def request_stop(self, stop: StopRequest) -> Stopping:
        """Begin a stop; returns how it goes on. Waits for no lock, no disk and no database."""
        if self.runner is None:
            return StopElsewhere(NO_BENCH, stands=True)
        return self.runner.stops.request(stop)

    @property
    def is_at_rest(self) -> bool:
        """Whether no campaign runs, or the one that ends has brought the table to rest."""
        return self.runner is None or self.runner.is_at_rest

    @property
    def not_stopped(self) -> str:
        """What is known of a stop that is late; empty where none is."""
        return "" if self.runner is None else self.runner.not_stopped

    def stop(self, reason: str) -> StopResponse:
        """Stop the bench, whatever runs there. Raises NotStopped, Conflict without a bench."""
        if self.runner is None:
            raise Conflict(WITHOUT_BENCH)
        stopping = self.runner.stops.request(StopRequest.new(actor().name, actor().via, reason))
        if not stopping.is_over(STOP_S) or not stopping.stands:
            raise NotStopped(not_stopped_text(stopping.text))
        return StopResponse(bench=self.runner.bench.name, stands=True, text=stopping.text, campaign=stopping.campaign)

    def note_unsupervised(self) -> None:
        """End what runs, to be resumed, where its recipe says so: no supervisor guards the bench any more."""
        if self.runner is not None:
            self.runner.note_unsupervised()

    def describe_running(self) -> BenchNow:
        """Return one sentence on what runs, from memory."""
        if self.runner is None:
            return BenchNow(f"{NO_BENCH.capitalize()}.")
        bench, campaign, late = self.runner.bench.name, self.runner.running, self.runner.not_stopped
        if campaign is None:
            return BenchNow(f"No campaign runs on bench {bench}.", not_stopped=late)
        text = f"Campaign {campaign} runs on bench {bench}, without its service."
        return BenchNow(text, runs=True, not_stopped=late)

    @property
    def polls(self) -> tuple[int, int] | None:
        """The campaign that runs, and how often its engine has asked for requests; None while none runs."""
        return None if self.runner is None else self.runner.polls

    def end_soon(self) -> None:
        """Begin nothing more and let what runs go to its end in the safe state; returns at once."""
        self.stops = True
        self.live.end_soon()
        if self.scheduler is not None:
            self.scheduler.end_soon()
        if self.runner is not None:
            self.runner.end_soon()

    def close(self) -> BenchLeft:
        """End what runs, in the safe state; returns how the bench was left."""
        self.end_soon()
        if self.scheduler is not None:
            self.scheduler.close()
        self.live.close()
        if self.runner is None:
            return BenchLeft()
        self.runner.close()
        return self._how_left(self.runner)

    def _how_left(self, runner: BenchRunner) -> BenchLeft:
        bench = runner.bench.name
        try:
            row = self._store.benches.get(bench)
        except StoreError as error:
            return BenchLeft(f"the safe state of bench {bench} cannot be read ({error}); inspect it", unconfirmed=True)
        if row is not None and row.unconfirmed:
            return BenchLeft(describe_bench(row), row.is_unconfirmed)
        return BenchLeft(describe_safe_state(bench, "") if runner.used else f"bench {bench} was not used")


def _scheduler(store: Store, clock: Clock, runner: BenchRunner) -> Scheduler:
    """Return the queue of a bench: on a real one, what was missed long ago does not begin by itself."""
    limit_s = None if runner.bench.is_simulated else REAL_BENCH_LATE_LIMIT_S
    return Scheduler(store, clock, runner, runner.bench.name, limit_s)
