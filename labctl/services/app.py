"""The house as a service holds it: the store, the clock, and the runner of one bench."""

from __future__ import annotations

from collections.abc import AsyncIterator
from importlib.metadata import version
from pathlib import Path
from typing import Any

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.actor import ITSELF, acting
from labctl.errors import Conflict, StoreError
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.event_stream import CampaignEventStream
from labctl.services.campaigns.execution import describe_safe_state
from labctl.services.campaigns.status import from_rows, looked_after
from labctl.services.commands.local import LocalCommands
from labctl.services.schedule import queue
from labctl.services.schedule.scheduler import Scheduler
from labctl.services.schemas.campaigns import (
    CampaignRequest,
    CampaignResponse,
    ConfirmRequest,
    EventResponse,
    ReasonRequest,
    ResumeRequest,
)
from labctl.services.schemas.schedule import ScheduledResponse
from labctl.store import Store
from procedures.execution.signals import add_shutdown_hook

NO_BENCH = "this service has no bench; start it with `labctl serve --bench FILE` or `--simulate`"


class ServiceCommands(LocalCommands):
    """The acts of a service: a campaign on its own bench is aborted by its runner."""

    def __init__(self, store: Store, clock: Clock, runner: BenchRunner | None) -> None:
        super().__init__(store, clock)
        self._runner = runner

    def abort_campaign(self, campaign: int, reason: str) -> CampaignResponse:
        """End a campaign now, in the safe state."""
        if self._runner is not None and self._runner.runs(campaign):
            try:
                self._note_campaign("abort", campaign, reason)
            finally:  # a disk that is full is no reason to go on
                answer = self._runner.abort(campaign, reason)
            return answer
        return super().abort_campaign(campaign, reason)

    def pause_campaign(self, campaign: int, request: ReasonRequest) -> CampaignResponse:
        """Ask a running campaign to hold after the present data set."""
        if self._runner is None:
            return super().pause_campaign(campaign, request)
        answer = self._runner.pause(campaign, request)
        self._note_campaign("pause", campaign, request.text)
        return answer

    def resume_campaign(self, campaign: int, request: ResumeRequest) -> CampaignResponse:
        """Let a paused campaign go on, or take up one that was interrupted."""
        if self._runner is None:
            raise Conflict(NO_BENCH)
        paused = self._runner.runs(campaign)  # what is taken up is noted with its rows
        answer = self._runner.resume(campaign, request)
        if paused:
            self._note_campaign("resume", campaign, f"{request.reason or 'goes on'} ({request.by})")
        return answer

    def confirm(self, campaign: int, request: ConfirmRequest) -> CampaignResponse:
        """Answer the question that a campaign has put."""
        if self._runner is None:
            return super().confirm(campaign, request)
        answer = self._runner.confirm(campaign, request)
        said = f"{request.prompt}: {'done' if request.confirmed else 'cannot be done'}; {request.by}; {request.reason}"
        self._note_campaign("confirm", campaign, said)
        return answer

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledResponse:
        """Enter a campaign into the schedule of this service's bench."""
        if self._runner is None:
            raise Conflict(NO_BENCH)
        if bench is not None and bench != self._runner.bench.name:
            raise Conflict(f"this service runs bench {self._runner.bench.name}, not {bench}; leave the bench out")
        return queue.add_start(self._store, request, self._runner.bench, self._clock.utc())

    def cancel_start(self, start: int) -> ScheduledResponse:
        """Take an entry out of the schedule."""
        return queue.cancel_start(self._store, start, self._clock.utc())


class LabService:
    """What a running service serves."""

    def __init__(self, store: Store, clock: Clock, runner: BenchRunner | None = None) -> None:
        self.store = store
        self.clock = clock
        self._runner = runner
        self.scheduler = None if runner is None else Scheduler(store, clock, runner, runner.bench.name)
        self._event_stream = CampaignEventStream(store, self.status, None if runner is None else runner.listen)
        self._opened_at = clock.utc()
        self._stops = self._closed = False
        self.left = ""  #: once it is closed: how the bench was left

    @property
    def bench(self) -> BenchFile | None:
        """The bench that this service runs, if it has one."""
        return None if self._runner is None else self._runner.bench

    def start(self) -> None:
        """Make the house ready: a campaign that an earlier process left on this bench is taken up, safe state first.

        Then the schedule runs: what is due waits for that campaign. A signal to end is heard here first: an HTTP server
        waits for its requests before it closes the house, and a listener may stay for hours.
        """
        add_shutdown_hook(self.end_soon)
        with acting(ITSELF):  # nobody asked for it
            if self._runner is not None:
                self._runner.resume_unfinished()
            if self.scheduler is not None:
                self.scheduler.start()

    def end_soon(self) -> None:
        """Begin nothing more and let what runs go to its end in the safe state; returns at once."""
        self._stops = True
        if self.scheduler is not None:
            self.scheduler.end_soon()
        if self._runner is not None:
            self._runner.end_soon()

    def close(self) -> None:
        """Begin nothing more, end what runs, leave the bench safe, close the store. Safe to call twice."""
        if self._closed:
            return
        self._closed = True
        if self.scheduler is not None:
            self.scheduler.close()
        if self._runner is not None:
            self._runner.close()
            self.left = self._how_left(self._runner)
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

    def commands(self) -> ServiceCommands:
        """Return who acts on the database."""
        return ServiceCommands(self.store, self.clock, self._runner)

    def bench_runner(self) -> BenchRunner:
        """Return the runner of this service's bench; raises Conflict when it has none."""
        if self._runner is None:
            raise Conflict(NO_BENCH)
        return self._runner

    def benches(self) -> list[dict[str, Any]]:
        """Describe the bench of this service."""
        return [] if self._runner is None else [self._runner.describe()]

    def status(self, campaign: int) -> CampaignResponse:
        """Return where a campaign is: live when it runs here, else as the database tells."""
        live = self._runner.status(campaign) if self._runner is not None else None
        if live is not None:
            return live
        row = self.store.campaigns.get(campaign)
        return looked_after(from_rows(self.store, row), by_somebody=self._runs(campaign))

    def _runs(self, campaign: int) -> bool:
        return self._runner is not None and self._runner.runs(campaign)

    def campaigns(self) -> list[CampaignResponse]:
        """Return every campaign, newest first."""
        return [self.status(row.id) for row in self.store.campaigns.all()]

    def follow(self, campaign: int, after: int) -> AsyncIterator[EventResponse | CampaignResponse | None]:
        """Tell where a campaign is, as `Followers.follow` does, until it ends or this service does."""
        return self._event_stream.follow(campaign, after, over=lambda: self._stops and not self._runs(campaign))

    def pulse(self) -> dict[str, Any]:
        """Return what anybody may know: that the service lives, and which."""
        return {"status": "ok", "version": version("labctl")}

    def health(self) -> dict[str, Any]:
        """Return whether the service is well."""
        unconfirmed = any(row.unconfirmed for row in self.store.benches.all())
        return {
            **self.pulse(),
            **({"status": "look at the bench"} if unconfirmed else {}),
            "database": Path(self.store.location).name,  # a folder, or a password in a URL, is nobody's business here
            "since": self._opened_at.isoformat(),
            "bench": self._runner.describe() if self._runner is not None else None,
            "schedule_trouble": self.scheduler.trouble if self.scheduler is not None else "",
        }

    def metrics(self) -> dict[str, float]:
        """Return figures for a monitor."""
        states = [row.state for row in self.store.campaigns.all()]
        return {
            "labctl_units": float(len(self.store.units.all())),
            "labctl_campaigns": float(len(states)),
            "labctl_campaigns_failed": float(states.count("failed")),
            "labctl_campaign_running": float(self._runner is not None and self._runner.busy),
        }
