"""The house as a service holds it: the store, the clock, and the runner of one bench."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from importlib.metadata import version
from typing import Any

from instruments.clock import Clock
from labctl.errors import Conflict
from labctl.services import scheduling
from labctl.services.acts import CampaignRequest
from labctl.services.answers import CampaignAnswer, EventAnswer, ScheduledAnswer
from labctl.services.bench_runner import BenchRunner
from labctl.services.campaigns import ENDED, campaign_status, event_answer
from labctl.services.opening import LocalActs
from labctl.services.scheduler import Scheduler
from labctl.store import Store

#: An open event stream says that it is alive after this long without an event.
HEARTBEAT_S = 10.0
NO_BENCH = "this service has no bench; start it with `labctl serve --bench FILE` or `--simulate`"


class ServiceActs(LocalActs):
    """The acts of a service: a campaign on its own bench is aborted by its runner."""

    def __init__(self, store: Store, clock: Clock, runner: BenchRunner | None) -> None:
        super().__init__(store, clock)
        self._runner = runner

    def abort_campaign(self, campaign: int, reason: str) -> CampaignAnswer:
        """End a campaign now, in the safe state."""
        if self._runner is not None and self._runner.runs(campaign):
            return self._runner.abort(campaign, reason)
        return super().abort_campaign(campaign, reason)

    def schedule_campaign(self, request: CampaignRequest, bench: str | None = None) -> ScheduledAnswer:
        """Enter a campaign into the schedule of this service's bench."""
        if self._runner is None:
            raise Conflict(NO_BENCH)
        if bench is not None and bench != self._runner.bench.name:
            raise Conflict(f"this service runs bench {self._runner.bench.name}, not {bench}; leave the bench out")
        return scheduling.add_start(self._store, request, self._runner.bench, self._clock.utc(), "service")

    def cancel_start(self, start: int) -> ScheduledAnswer:
        """Take an entry out of the schedule."""
        return scheduling.cancel_start(self._store, start, self._clock.utc(), "service")


class House:
    """What a running service serves."""

    def __init__(self, store: Store, clock: Clock, runner: BenchRunner | None = None) -> None:
        self.store = store
        self.clock = clock
        self._runner = runner
        self.scheduler = None if runner is None else Scheduler(store, clock, runner, runner.bench.name)
        self._opened_at = clock.utc()

    def start(self) -> None:
        """Make the house ready: campaigns that an earlier process left are marked as such, then the schedule runs."""
        for row in self.store.campaigns.unfinished():
            self.store.campaigns.close_unfinished(row.id, "the process that ran it ended", self.clock.utc())
        if self.scheduler is not None:
            self.scheduler.start()

    def close(self) -> None:
        """Begin nothing more, end what runs, leave the bench safe, close the store."""
        if self.scheduler is not None:
            self.scheduler.close()
        if self._runner is not None:
            self._runner.close()
        self.store.close()

    def acts(self) -> ServiceActs:
        """Return who acts on the database."""
        return ServiceActs(self.store, self.clock, self._runner)

    def bench_runner(self) -> BenchRunner:
        """Return the runner of this service's bench; raises Conflict when it has none."""
        if self._runner is None:
            raise Conflict(NO_BENCH)
        return self._runner

    def benches(self) -> list[dict[str, Any]]:
        """Describe the bench of this service."""
        return [] if self._runner is None else [self._runner.describe()]

    def status(self, campaign: int) -> CampaignAnswer:
        """Return where a campaign is: live when it runs here, else as the database tells."""
        live = self._runner.status(campaign) if self._runner is not None else None
        return live or campaign_status(self.store, campaign)

    async def follow(self, campaign: int, after: int) -> AsyncIterator[EventAnswer]:
        """Yield a campaign's events from the one after number `after`, until the campaign ends."""
        bell = asyncio.Event()
        loop = asyncio.get_running_loop()

        def ring() -> None:
            loop.call_soon_threadsafe(bell.set)

        stop = self._runner.listen(ring) if self._runner is not None else None
        try:
            while True:
                bell.clear()
                # from the database, not the live picture: the last event is written before the state there ends
                state = (await asyncio.to_thread(self.store.campaigns.get, campaign)).state
                for row in await asyncio.to_thread(self.store.campaigns.events, campaign, after):
                    after = row.id
                    yield event_answer(row)
                if state in ENDED:
                    return
                try:
                    await asyncio.wait_for(bell.wait(), HEARTBEAT_S)
                except TimeoutError:
                    continue
        finally:
            if stop is not None:
                stop()

    def health(self) -> dict[str, Any]:
        """Return whether the service is well."""
        return {
            "status": "ok",
            "version": version("labctl"),
            "database": self.store.location,
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
