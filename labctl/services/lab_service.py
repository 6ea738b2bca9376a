"""The service: its store, its clock, and the runner of one bench."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import ExitStack
from importlib.metadata import version
from pathlib import Path
from typing import Any

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.acting_user import ITSELF, acting
from labctl.errors import StoreError
from labctl.services.benches.start_confirmation import start_questions
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.event_stream import CampaignEventStream
from labctl.services.campaigns.execution import describe_safe_state
from labctl.services.campaigns.resumability import NO_BENCH, with_resume
from labctl.services.campaigns.status import from_rows, mark_abandoned, statuses_of
from labctl.services.commands.command import Command, LocalExecutor, RequestT, ResponseT
from labctl.services.commands.context import CommandContext
from labctl.services.commands.service_control import ServiceControl
from labctl.services.schedule.scheduler import Scheduler
from labctl.services.schemas.campaigns import (
    CampaignResponse,
    EventResponse,
)
from labctl.store import Store
from procedures.execution.signals import shutdown_hook

VERSION = version("labctl")


class LabService:
    """What a running service serves."""

    def __init__(self, store: Store, clock: Clock, runner: BenchRunner | None = None) -> None:
        self.store = store
        self.clock = clock
        self.bench_runner = runner
        self._executor = LocalExecutor(CommandContext(lambda: store, clock, ServiceControl(runner)))
        self.scheduler = None if runner is None else Scheduler(store, clock, runner, runner.bench.name)
        self._event_stream = CampaignEventStream(store, self.status, None if runner is None else runner.listen)
        self._opened_at = clock.utc()
        self._stops = self._closed = False
        self._hooks = ExitStack()
        self.left = ""  #: once it is closed: how the bench was left

    @property
    def bench(self) -> BenchFile | None:
        """The bench that this service runs, if it has one."""
        return None if self.bench_runner is None else self.bench_runner.bench

    def start(self) -> None:
        """Resume the campaign that an earlier process left on this bench, safe state first; then start the schedule.

        What is due waits for that campaign. A signal to end is handled here first: an HTTP server waits for its
        requests before it closes the service, and a client may follow a campaign for hours.
        """
        self._hooks.enter_context(shutdown_hook(self.end_soon))
        with acting(ITSELF):  # no request asked for it
            if self.bench_runner is not None:
                self.bench_runner.resume_unfinished()
            if self.scheduler is not None:
                self.scheduler.start()

    def end_soon(self) -> None:
        """Begin nothing more and let what runs go to its end in the safe state; returns at once."""
        self._stops = True
        if self.scheduler is not None:
            self.scheduler.end_soon()
        if self.bench_runner is not None:
            self.bench_runner.end_soon()

    def close(self) -> None:
        """Begin nothing more, end what runs, leave the bench safe, close the store. Safe to call twice."""
        if self._closed:
            return
        self._closed = True
        with self._hooks:
            if self.scheduler is not None:
                self.scheduler.close()
            if self.bench_runner is not None:
                self.bench_runner.close()
                self.left = self._how_left(self.bench_runner)
            self.store.close()

    def _how_left(self, runner: BenchRunner) -> str:
        bench = runner.bench.name
        try:
            unconfirmed = self.store.benches.unconfirmed(bench)
            return (
                describe_safe_state(bench, unconfirmed) if runner.used or unconfirmed else f"bench {bench} was not used"
            )
        except StoreError as error:
            return f"whether bench {bench} is safe cannot be read ({error}); look at it"

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Execute a command on this service's store and bench. Raises LabctlError."""
        return self._executor.execute(command, request)

    def benches(self) -> list[dict[str, Any]]:
        """Describe the bench of this service."""
        if self.bench_runner is None:
            return []
        return [{**self.bench_runner.describe(), "start_questions": start_questions(self.bench_runner.bench)}]

    def status(self, campaign: int) -> CampaignResponse:
        """Return where a campaign is: live when it runs here, else as the database tells."""
        answer = self._live(campaign)
        if answer is None:
            row = self.store.campaigns.get(campaign)
            answer = mark_abandoned(from_rows(self.store, row), attended=self._runs(campaign))
        runner = self.bench_runner
        if runner is None:
            return answer.model_copy(update={"resumable": False, "resume_reason": NO_BENCH})
        return with_resume(self.store, answer, runner.bench, lambda: runner.running)

    def _live(self, campaign: int) -> CampaignResponse | None:
        return None if self.bench_runner is None else self.bench_runner.status(campaign)

    def _runs(self, campaign: int) -> bool:
        return self.bench_runner is not None and self.bench_runner.runs(campaign)

    def campaigns(self) -> list[CampaignResponse]:
        """Return every campaign, newest first."""
        stored = statuses_of(self.store, self.store.campaigns.all())
        return [self._live(each.id) or mark_abandoned(each, attended=self._runs(each.id)) for each in stored]

    def follow(self, campaign: int, after: int) -> AsyncIterator[EventResponse | CampaignResponse | None]:
        """Yield where a campaign is, as `CampaignEventStream.follow` does, until it ends or this service does."""
        return self._event_stream.follow(campaign, after, over=lambda: self._stops and not self._runs(campaign))

    def pulse(self) -> dict[str, Any]:
        """Return what a caller without a key may know: that the service answers, and its version."""
        return {"status": "ok", "version": VERSION}

    def heartbeat(self) -> dict[str, Any]:
        """Return what every open page asks once a second: that the service answers; reads no database."""
        return self.pulse()

    def health(self) -> dict[str, Any]:
        """Return whether the service is well."""
        unconfirmed = any(row.unconfirmed for row in self.store.benches.all())
        return {
            **self.pulse(),
            **({"status": "look at the bench"} if unconfirmed else {}),
            "database": Path(self.store.location).name,  # a folder, or a password in a URL, is not shown
            "since": self._opened_at.isoformat(),
            "bench": self.bench_runner.describe() if self.bench_runner is not None else None,
            "schedule_trouble": self.scheduler.trouble if self.scheduler is not None else "",
        }

    def metrics(self) -> dict[str, float]:
        """Return figures for a monitor."""
        states = self.store.campaigns.states()
        return {
            "labctl_units": float(len(self.store.units.all())),
            "labctl_campaigns": float(len(states)),
            "labctl_campaigns_failed": float(states.count("failed")),
            "labctl_campaign_running": float(self.bench_runner is not None and self.bench_runner.busy),
        }
