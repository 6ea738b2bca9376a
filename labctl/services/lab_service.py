"""The service: its store, its clock, and the access to its bench."""

from __future__ import annotations

from collections.abc import AsyncIterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from importlib.metadata import version

from instruments.bench_config import BenchFile
from instruments.clock import Clock
from labctl.answers.benches import BenchResponse, StopResponse
from labctl.answers.campaigns import CampaignResponse, EventResponse
from labctl.answers.drafts import DraftsRequest, DraftsResponse
from labctl.answers.live import LiveStateResponse
from labctl.answers.service import HealthResponse, HeartbeatResponse, PulseResponse
from labctl.services.admin.replica import ReplicaWatch, replica
from labctl.services.background import BackgroundWork
from labctl.services.bench_access import BenchAccess
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.benches.driving_process import driven_benches
from labctl.services.benches.start_confirmation import start_questions
from labctl.services.calibrations.fetch_log import FetchLog
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.event_stream import CampaignEventStream
from labctl.services.campaigns.resumability import RESUME_ELSEWHERE, with_resume
from labctl.services.campaigns.status import from_rows, mark_abandoned, statuses_of
from labctl.services.check_gyros import alarms
from labctl.services.commands.acts.start import START_CAMPAIGN
from labctl.services.commands.command import Command, LocalExecutor, RequestT, ResponseT
from labctl.services.commands.computed import carry_out
from labctl.services.commands.context import CommandContext
from labctl.services.commands.registry import MAKE_DRAFTS
from labctl.services.commands.requests import CampaignStart, ToCampaign
from labctl.services.computation import Computation, InThreads, Pending
from labctl.services.diagnosis.in_service import ServiceLaboratory, criticise_together
from labctl.services.diagnosis.watch import DiagnosisWatch
from labctl.services.drafts.answers import with_drafts
from labctl.services.drafts.watch import DraftWatch
from labctl.services.fleet.engines import LOCAL, ComputationEngine, Engine, open_engine
from labctl.services.fleet.watch import FleetWatch
from labctl.services.joint_reads import JointReads
from labctl.services.live.live_stream import LiveEventStream
from labctl.services.local_bench import LocalBench
from labctl.services.recordings.staging import remove_abandoned
from labctl.services.standards.register import count_by_state
from labctl.services.sufficiency.answers import with_target
from labctl.services.units import count_due
from labctl.store import Store, database_name, keys_by_digests, served_together
from labctl.store.paging import Page, PageRequest
from procedures.contracts.campaign_state import ENDED
from procedures.execution.signals import shutdown_hook

VERSION = version("labctl")
#: How far ahead the monitor counts units that are due.
DUE_SOON = timedelta(days=30)


@dataclass(frozen=True)
class ServiceFigures:
    """Figures for a monitor."""

    units: int
    campaigns: Mapping[str, int]  #: by state
    running: bool  #: whether a campaign runs on the bench of this service
    heard_s: float  #: time since the last answer of the bench, s
    overdue: int  #: units whose certification has ended
    due_soon: int  #: units whose certification has ended, or ends within `DUE_SOON`
    standards: Mapping[str, int]  #: reference standards by state
    check_gyro_alarms: int  #: check gyros whose newest result is out of its control limits


class LabService:
    """What a running service serves. Its bench is driven by a runner in this process, or reached through `access`."""

    def __init__(
        self,
        store: Store,
        clock: Clock,
        runner: BenchRunner | None = None,
        computation: Computation | None = None,
        *,
        access: BenchAccess | None = None,
        acts_at: str | None = None,
    ) -> None:
        """Serve a store; what takes long is done by `computation`, default: in the threads that ask for it.

        `acts_at` is the address of the service that acts, where this one only reads its store.
        """
        self.store = store
        self.computation = computation or InThreads(store)
        self.clock = clock
        self.acts_at = acts_at
        self.fetches = FetchLog(store)
        self._lookups = store.certifications.lookup(), store.keys.lookup()
        in_force, keys = self._lookups
        self.in_force = JointReads(partial(served_together, in_force))
        self.keys = JointReads(partial(keys_by_digests, keys))
        self.bench_access: BenchAccess = access or LocalBench(store, clock, runner)
        self._executor = LocalExecutor(CommandContext(lambda: store, clock, self.bench_access.control))
        self._event_stream = CampaignEventStream(store, self.status, self.bench_access.listen)
        self._live_stream = LiveEventStream(
            lambda: self.bench_access.live_state(watched=True), self.bench_access.listen
        )
        self._drafts = DraftWatch(store, clock, lambda: None if self.bench is None else self.bench.name, self._draft)
        laboratory = ServiceLaboratory(
            store,
            lambda *asked: self.computation.run(criticise_together, *asked),
            lambda request: self.execute(START_CAMPAIGN, CampaignStart(request)),
        )
        self._diagnoses = DiagnosisWatch(
            store, clock, lambda: None if self.bench is None else self.bench.name, laboratory
        )
        self._fleet = FleetWatch(store, clock, self._open_engine)
        self._replica = ReplicaWatch(store, clock)
        watches = (self._replica,) if store.is_read_only else (self._drafts, self._diagnoses, self._fleet)
        self._backgrounds: tuple[BackgroundWork, ...] = tuple(watch.background for watch in watches)
        self._opened_at = clock.utc()
        self._closed = False
        self._hooks = ExitStack()
        self.left = BenchLeft()  #: once it is closed

    @property
    def bench(self) -> BenchFile | None:
        """The bench that this service runs, if it has one."""
        return self.bench_access.bench

    def start(self) -> None:
        """Resume what an earlier process left on the bench, and start the schedule.

        A signal to end is obeyed here at once: an HTTP server waits for its requests before it closes the service, and
        a client may follow a campaign for hours.
        """
        self._hooks.enter_context(shutdown_hook(self.end_soon))
        remove_abandoned()
        self.bench_access.start()
        for background in self._backgrounds:
            background.start()

    def _open_engine(self, name: str) -> Engine:
        """Open the engine of a fleet job; without worker processes its tasks are done as all others are."""
        if name == LOCAL and isinstance(self.computation, InThreads):
            return ComputationEngine(self.computation, 1)
        return open_engine(name, self.store.address)

    def _draft(self, campaign: int) -> DraftsResponse:
        return self.execute(MAKE_DRAFTS, ToCampaign(campaign, DraftsRequest()))

    def end_soon(self) -> None:
        """Begin nothing more and let what runs go to its end in the safe state; returns at once."""
        for background in self._backgrounds:
            background.end_soon()
        self.bench_access.end_soon()
        self.computation.end_soon()

    def close(self) -> None:
        """Begin nothing more, end what runs, leave the bench safe, close the store. Safe to call twice."""
        if self._closed:
            return
        self._closed = True
        with self._hooks:
            self.left = self.bench_access.close()
            for background in self._backgrounds:
                background.end_soon()
            self.computation.close()
            for background in self._backgrounds:
                background.close()
            self.fetches.write()
            for lookup in self._lookups:
                lookup.close()
            self.store.close()

    def execute(self, command: Command[RequestT, ResponseT], request: RequestT) -> ResponseT:
        """Execute a command on this service's store and bench. Raises LabctlError."""
        if command.computes:
            return self.computation.run(carry_out, command.handler, request, self.clock.utc(), writes=True)
        return self._executor.execute(command, request)

    def submit(self, command: Command[RequestT, ResponseT], request: RequestT) -> Pending[ResponseT]:
        """Begin to execute a command that computes; returns at once. Raises TooBusy."""
        return self.computation.submit(carry_out, command.handler, request, self.clock.utc(), writes=True)

    def benches(self) -> list[BenchResponse]:
        """Describe the bench of this service."""
        described = self.bench_access.describe()
        if described is None or self.bench is None:
            return []
        return [BenchResponse(**dict(described), start_questions=start_questions(self.bench))]

    def status(self, campaign: int) -> CampaignResponse:
        """Return where a campaign is: live when it runs here, else as the database tells."""
        return with_target(self.store, with_drafts(self.store, self._status(campaign)))

    def _status(self, campaign: int) -> CampaignResponse:
        access = self.bench_access
        answer = access.status(campaign)
        if answer is None:
            row = self.store.campaigns.get(campaign)
            answer = mark_abandoned(from_rows(self.store, row), attended=self._is_attended(campaign, row.bench_name))
        if access.bench is None:
            return answer.model_copy(update={"resumable": False, "resume_reason": RESUME_ELSEWHERE})
        return with_resume(self.store, answer, access.bench, lambda: access.running)

    def campaigns(self, request: PageRequest[int]) -> Page[CampaignResponse, int]:
        """Return campaigns, newest first, as many as are asked for."""
        page = self.store.campaigns.page(request)
        answers = [self._as_it_runs(stored) for stored in statuses_of(self.store, page.rows)]
        return Page(answers, page.total, page.next_after)

    def _as_it_runs(self, stored: CampaignResponse) -> CampaignResponse:
        if stored.state in ENDED:
            return stored
        live = self.bench_access.status(stored.id)
        return live or mark_abandoned(stored, attended=self._is_attended(stored.id, stored.bench))

    def _is_attended(self, campaign: int, bench: str) -> bool:
        """Return whether a process runs a campaign: this service on its own bench, or another one on another bench."""
        is_own = self.bench is not None and self.bench.name == bench
        if self.store.is_read_only and not self.store.is_shared:
            return self.store.is_held
        if is_own or not self.store.is_shared:
            return self.bench_access.runs(campaign)
        return bench in driven_benches(self.store)

    def follow(self, campaign: int, after: int) -> AsyncIterator[EventResponse | CampaignResponse | None]:
        """Yield where a campaign is, as `CampaignEventStream.follow` does, until it ends or this service does."""
        access = self.bench_access
        return self._event_stream.follow(campaign, after, over=lambda: access.stops and not access.runs(campaign))

    def follow_live(self, first: LiveStateResponse) -> AsyncIterator[LiveStateResponse | None]:
        """Yield how the live calibration stands, as `LiveEventStream.follow` does, until it or this service ends."""
        return self._live_stream.follow(first, over=lambda: self.bench_access.stops)

    def pulse(self) -> PulseResponse:
        """Return what a caller without a key may know: that the service answers, and its version."""
        return PulseResponse(version=VERSION)

    def heartbeat(self) -> HeartbeatResponse:
        """Return what every open page asks once a second: that the service answers; reads no database."""
        access = self.bench_access
        return HeartbeatResponse(
            version=VERSION, heard_s=round(access.heard_s, 1), not_stopped=access.not_stopped,
            read_only=self.store.is_read_only, acts_at=self.acts_at, replica=self._replica.state(),
        )  # fmt: skip

    def stop_bench(self, reason: str) -> StopResponse:
        """Stop whatever runs on the bench of this service. Raises NotStopped, Conflict without a bench."""
        return self.bench_access.stop(reason)

    def health(self) -> HealthResponse:
        """Return whether the service is well."""
        bench = self.bench_access.describe()
        unconfirmed = any(row.unconfirmed for row in self.store.benches.all()) or bool(bench and bench.unconfirmed)
        return HealthResponse(
            status="look at the bench" if unconfirmed else "ok",
            version=VERSION,
            database=database_name(self.store.location),
            since=self._opened_at.isoformat(),
            bench=bench,
            schedule_trouble=self.bench_access.schedule_trouble,
            read_only=self.store.is_read_only,
            acts_at=self.acts_at,
            replica=replica(self.store),
        )

    def metrics(self) -> ServiceFigures:
        """Return figures for a monitor."""
        access = self.bench_access
        overdue, soon = count_due(self.store, self.clock.utc(), DUE_SOON)
        return ServiceFigures(
            self.store.units.count(), self.store.campaigns.count_by_state(), access.running is not None, access.heard_s,
            overdue, soon, count_by_state(self.store, self.clock.utc().date()), alarms(self.store),
        )  # fmt: skip
