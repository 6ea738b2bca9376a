"""Begins scheduled campaigns on a service's bench: one at a time, highest priority first, each start at most once.

A start is claimed in the database before anything is opened, and concluded when its campaign is written down. What a
process claimed and did not conclude is settled at the next start of a service: begun if there is a campaign of it, else
due again.

A start that this service could not begin in time may be missed: the entry's own limit counts from its due time. Without
one, a real bench has a default limit, because a person has confirmed that the bench is clear at that time, not hours
later. The time in which a campaign was seen on the bench does not count against the default: a start that queues behind
a campaign was not missed. What an earlier service saw is read from the records of the campaign, so a restart neither
excuses a start nor makes it late.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from datetime import datetime, timedelta
from typing import Protocol

from instruments.clock import Clock
from instruments.errors import InstrumentError
from labctl.answers.campaigns import BENCH_CHECKS, CampaignRequest, CampaignResponse
from labctl.errors import BenchBusy, LabctlError
from labctl.log import get_logger
from labctl.services.schedule import times
from labctl.store import StartEventRow, StartRow, Store
from procedures.contracts.errors import ProcedureError

log = get_logger()

POLL_S = 1.0
#: A start within this is on time: the schedule is read once a second, and a service takes a while to start.
GRACE_S = 60.0
#: A start without a limit of its own that is later than this is not made up on a real bench.
REAL_BENCH_LATE_LIMIT_S = 3600.0


class Runs(Protocol):
    """Who runs campaigns on the bench."""

    @property
    def free(self) -> bool:
        """Whether a campaign may begin now."""
        ...

    @property
    def occupied(self) -> bool:
        """Whether a campaign runs or waits to be resumed, or another process drives the bench."""
        ...

    def resume_interrupted(self) -> None:
        """Resume what was interrupted, as soon as that is allowed."""
        ...

    def start(self, request: CampaignRequest, *, attended: bool) -> CampaignResponse:
        """Begin a campaign; not `attended`: no person starts it now."""
        ...


class Scheduler:
    """The queue of one bench; `late_limit_s` holds for entries without a limit of their own, None: no limit."""

    def __init__(
        self, store: Store, clock: Clock, runner: Runs, bench_name: str, late_limit_s: float | None = None
    ) -> None:
        self._store, self._clock, self._runner, self._bench = store, clock, runner, bench_name
        self._late_limit_s = late_limit_s
        self._was_occupied = False  #: when the schedule was read last
        self._occupied_until: datetime | None = None  #: the last moment at which the bench was seen occupied
        self._knows_the_past = False  #: whether that is known of the time before this service
        self._guard = threading.Lock()
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        self.attended: Callable[[], bool] = lambda: True  #: whether a campaign that begins could be seen and ended
        self.trouble = ""  #: why the schedule could not be read
        self._owes = False  #: what became of a start could not be written down

    def start(self) -> None:
        """Settle what an earlier process left, then carry out the schedule from now on, in a thread."""
        self.settle()
        self._thread = threading.Thread(target=self._watch, name="scheduler", daemon=True)
        self._thread.start()

    def end_soon(self) -> None:
        """Begin nothing more; returns at once."""
        self._over.set()

    def close(self) -> None:
        """Begin nothing more."""
        self.end_soon()
        if self._thread is not None:
            self._thread.join()

    def _watch(self) -> None:
        while not self._over.wait(self._clock.wall_s(POLL_S)):
            try:
                self.tick()
                self._note_trouble("")
            except Exception as error:  # noqa: BLE001  the thread has to survive, or no start is made any more
                self._note_trouble(f"{type(error).__name__}: {error}", error)

    def _note_trouble(self, trouble: str, error: Exception | None = None) -> None:
        """Show why the schedule could not be read, and log that it changed."""
        if trouble != self.trouble and error is not None:
            log.error("schedule.trouble", bench=self._bench, error=trouble, exc_info=error)
        elif trouble != self.trouble:
            log.info("schedule.well", bench=self._bench)
        self.trouble = trouble

    def settle(self) -> None:
        """Conclude what an earlier process claimed: begun if there is a campaign of it, else due again."""
        now = self._clock.utc()
        for event in self._store.starts.open_claims(self._bench):
            began = self._store.campaigns.first_after(event.after_campaign, self._bench)
            if began is not None:
                self._store.starts.conclude(event, now, "started", f"campaign {began} began", began)
            else:
                self._store.starts.put_back(event)

    def tick(self) -> None:
        """Go on with what was interrupted, drop what is too late, then begin what is due and goes first.

        Raises StoreError.
        """
        with self._guard:
            if self._owes:
                self.settle()
                self._owes = False
            self.read_the_past()
            self._runner.resume_interrupted()
            now = self._clock.utc()
            if self._was_occupied and self._runner.occupied:  # also through a pause of this process
                self._occupied_until = now
            for row in self._store.starts.due(self._bench, now):
                due = row.due_at if row.cron is None else self._last_due(row, row.cron, now)
                if reason := self._why_missed(row, due, now):
                    self._store.starts.take(row, due, self._next(row, now), now, "missed", reason)
                    log.warning(
                        "schedule.missed", bench=self._bench, start=row.id, recipe=row.recipe_name, reason=reason
                    )
                elif self._runner.free and self.attended():
                    self._begin(row, due, now)
            self._was_occupied = self._runner.occupied
            if self._was_occupied:
                self._occupied_until = self._clock.utc()

    def read_the_past(self) -> None:
        """Learn once until when a campaign was on the bench before this service began. Raises StoreError.

        To be called before that campaign is resumed, which writes as well.
        """
        if self._knows_the_past:
            return
        last = self._store.campaigns.last_on_bench(self._bench)
        self._occupied_until = None if last is None else min(last, self._clock.utc())
        self._knows_the_past = True

    def _why_missed(self, row: StartRow, due: datetime, now: datetime) -> str:
        """Return why a start that is due is too late to begin, and what to do; empty while it may begin."""
        late_s = (now - due).total_seconds()
        limit_s, counted_s, of_bench = row.late_limit_s, late_s, ""
        if limit_s is None:
            limit_s, of_bench = self._late_limit_s, " of a real bench"
            counted_s = (now - max(due, self._occupied_until or due)).total_seconds()
        if limit_s is None or counted_s <= max(limit_s, GRACE_S):
            return ""
        behind = f", {_span(counted_s)} of it without a campaign on the bench" if counted_s < late_s else ""
        return (
            f"missed: the start was {_span(late_s)} late{behind}, and the limit{of_bench} is {_span(limit_s)}; check "
            f"the bench, then start recipe {row.recipe_name} again, now or with --at TIME"
        )

    @staticmethod
    def _last_due(row: StartRow, cron: str, now: datetime) -> datetime:
        """Return the newest due time that has come; earlier ones that were missed count as one start with it."""
        return times.last_due(cron, times.time_zone(row.time_zone), row.due_at, now)

    @staticmethod
    def _next(row: StartRow, now: datetime) -> datetime | None:
        if row.cron is None:
            return None
        return times.next_due(row.cron, times.time_zone(row.time_zone), now)

    def _begin(self, row: StartRow, due: datetime, now: datetime) -> None:
        starts = self._store.starts
        claim = starts.take(row, due, self._next(row, now), now, "claimed", "is being started")
        if claim is None:
            return
        self._owes = True
        self._start(claim, row, due, now)
        self._owes = False

    def _start(self, claim: StartEventRow, row: StartRow, due: datetime, now: datetime) -> None:
        starts = self._store.starts
        try:
            campaign = self._runner.start(_request(row), attended=False).id
        except BenchBusy:  # another campaign began first: this one waits
            starts.put_back(claim)
        except (LabctlError, InstrumentError, ProcedureError) as error:
            starts.conclude(claim, self._clock.utc(), "refused", str(error))
            log.error("schedule.refused", bench=self._bench, start=row.id, recipe=row.recipe, reason=str(error))
        except Exception as error:
            starts.conclude(claim, self._clock.utc(), "refused", f"{type(error).__name__}: {error}")
            raise
        else:
            late = now - due
            text = f", {_span(late.total_seconds())} late" if late > timedelta(seconds=GRACE_S) else ""
            starts.conclude(claim, self._clock.utc(), "started", f"campaign {campaign} began{text}", campaign)
            late_s = round(late.total_seconds())
            log.info("schedule.started", bench=self._bench, start=row.id, campaign=campaign, late_s=late_s)


def _request(row: StartRow) -> CampaignRequest:
    """Return the start of an entry, with the confirmation that was given when it was entered."""
    checks = list(BENCH_CHECKS) if row.confirmed_by else []
    return CampaignRequest(
        recipe=row.recipe, clip=row.clip, hide=list(row.hide or ()), fit=row.fit, confirmed_by=row.confirmed_by or "",
        checks=checks,
    )  # fmt: skip


def _span(seconds: float) -> str:
    """Write a time span as a person says it."""
    minutes = round(seconds / 60)
    return (
        f"{seconds:.0f} s"
        if minutes < 2
        else f"{minutes // 60} h {minutes % 60:02d} min"
        if minutes >= 60
        else f"{minutes} min"
    )
