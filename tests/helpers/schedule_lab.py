"""A queue of starts in virtual time, on a bench that only notes what is asked of it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from instruments.clock import VirtualClock
from labctl.answers.campaigns import CampaignRequest, CampaignResponse
from labctl.errors import Conflict
from labctl.services.planning.loading import load_bench
from labctl.services.schedule.queue import add_start, start_status
from labctl.services.schedule.scheduler import Scheduler
from labctl.store import Store

BENCH = load_bench("single-axis-sim")
START = datetime(2026, 1, 5, 8, tzinfo=UTC)


class Lab:
    """A store, a virtual clock and a bench that only notes what is asked of it."""

    def __init__(self, store: Store, start: datetime = START, late_limit_s: float | None = None) -> None:
        self.store, self.late_limit_s = store, late_limit_s
        self.clock = VirtualClock(start)
        self.free = True
        self.occupied = False
        self.went_on = 0
        self.begun: list[tuple[datetime, str]] = []
        self.refusal: BaseException | None = None
        self.scheduler = self.service()

    def service(self) -> Scheduler:
        return Scheduler(self.store, self.clock, self, BENCH.name, self.late_limit_s)

    def occupy(self, *, occupied: bool) -> None:
        """Begin a campaign that is not of the queue, or end it."""
        self.occupied, self.free = occupied, not occupied

    def resume_interrupted(self) -> None:
        self.went_on += 1

    def start(self, request: CampaignRequest, *, attended: bool) -> CampaignResponse:
        assert not attended
        if self.refusal is not None:
            raise self.refusal
        self.begun.append((self.clock.utc(), request.recipe))
        raise Conflict("a bench of paper")  # what is tried counts here; real campaigns come below

    def enter(self, recipe: str = "short", **when: object) -> int:
        request = CampaignRequest.model_validate({"recipe": recipe, **when})
        return add_start(self.store, request, BENCH, self.clock.utc()).id

    def live(self, duration: timedelta, every_s: float = 60.0) -> None:
        until = self.clock.utc() + duration
        while self.clock.utc() < until:
            self.scheduler.tick()
            self.clock.sleep(every_s)

    def outcomes(self, start: int) -> list[str]:
        return [event.outcome for event in start_status(self.store, start).history]

    def message(self, start: int) -> str:
        return start_status(self.store, start).history[-1].message
