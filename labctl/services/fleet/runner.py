"""The coordinator of a job: gives the tasks of its units to an engine and writes each result once."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import closing
from dataclasses import dataclass
from datetime import timedelta

from instruments.clock import Clock
from labctl.acting_user import Actor, acting
from labctl.answers.fleet import FleetJobRequest, FleetJobState
from labctl.errors import ComputationEnded, LabctlError, StoreError, TooBusy, VersionTaken
from labctl.log import get_logger
from labctl.services.cache import code_digest
from labctl.services.fleet.engines import Engine, UnderWay
from labctl.services.fleet.source import refuse_missing_source
from labctl.services.fleet.task import FleetTask, Outcome, skipped
from labctl.store import FleetJobRow, FleetResult, Store
from labctl.store.paging import PageRequest

log = get_logger()

#: A unit whose worker died is given to another one so often.
TRIES = 3
#: Units that are read at a time.
UNITS_AT_ONCE = 200
#: How long a result is waited for before a cancel is looked for, s.
POLL_INTERVAL_S = 1.0
#: A process without a sign of life for so long has left its job.
LEFT_AFTER = timedelta(seconds=60)
#: After the first unit that failed, and after so many more without one that did not, the storage is looked for.
FAILED_IN_A_ROW = 20
Report = Callable[[], None]


def carry_out(
    store: Store,
    clock: Clock,
    job: int,
    runner: str,
    make_engine: Callable[[], Engine],
    report: Report = lambda: None,
    over: Callable[[], bool] = lambda: False,
) -> None:
    """Carry out a job with an engine of its own, unless another process does. Raises LabctlError, as `JobRun.run`."""
    if not store.fleet.take(job, runner, clock.utc() - LEFT_AFTER, clock.utc()):
        return
    try:
        refuse_missing_source(FleetJobRequest.model_validate(store.fleet.get(job).request).source)
        engine = make_engine()
    except LabctlError as error:
        store.fleet.end(job, runner, "failed", str(error), clock.utc())
        raise
    with closing(engine):
        JobRun(store, clock, store.fleet.get(job), runner, engine).run(report, over)


@dataclass(frozen=True)
class _Ending:
    """How a run ends; running: nothing is written, and the job is resumed later."""

    state: FleetJobState
    why: str = ""


class JobRun:
    """One job, carried out by this process until it is done, cancelled or cannot go on."""

    def __init__(self, store: Store, clock: Clock, job: FleetJobRow, runner: str, engine: Engine) -> None:
        self._store, self._clock, self._job, self._runner, self._engine = store, clock, job, runner, engine
        self._request = FleetJobRequest.model_validate(job.request)
        self._under_way: dict[Future[Outcome], tuple[FleetTask, UnderWay]] = {}
        self._again: deque[str] = deque()
        self._tries: Counter[str] = Counter()
        self._failed_in_a_row = 0
        from labctl.services.fleet.evidence import EvidenceParts  # noqa: PLC0415  slow to load, for a job alone

        self._evidence = EvidenceParts()

    def run(self, report: Report = lambda: None, over: Callable[[], bool] = lambda: False) -> FleetJobState:
        """Carry out what is left; returns how it ended, or `waiting` where `over` said so: another process goes on.

        `report` is called after each result, to report progress. An interrupt ends the job as a cancel does: what was
        written stays, and what is under way is ended. Raises LabctlError where it cannot go on; a StoreError leaves it
        as it is, and it is resumed later.
        """
        ending = _Ending("cancelled", "interrupted; start it again, units that are done are skipped")
        try:
            with acting(Actor(self._job.by, f"fleet job {self._job.id}")):
                ending = self._carry_out(report, over)
        except StoreError:
            ending = _Ending("running")
            raise
        except LabctlError as error:
            ending = _Ending("failed", str(error))
            raise
        finally:
            for _, under_way in self._under_way.values():
                under_way.leave()
            self._write_end(ending)
        return ending.state

    def _write_end(self, ending: _Ending) -> None:
        fleet, now = self._store.fleet, self._clock.utc()
        if ending.state != "running":
            for part in self._evidence.rest():
                fleet.keep_evidence(self._job.id, part)
        if ending.state == "waiting":
            fleet.release(self._job.id, self._runner)
        elif ending.state != "running":
            fleet.end(self._job.id, self._runner, ending.state, ending.why, now)
        log.info("fleet.ended", job=self._job.id, state=ending.state, why=ending.why)

    def _carry_out(self, report: Report, over: Callable[[], bool]) -> _Ending:
        """Do every unit that is left, until the job is to stop. Raises LabctlError."""
        left = self._tasks()
        while True:
            if over():
                return _Ending("waiting")
            if not self._store.fleet.is_wanted(self._job.id, self._runner, self._clock.utc()):
                return _Ending("cancelled")
            self._fill(left)
            if not self._under_way:
                return _Ending("done")
            finished, _ = wait(list(self._under_way), timeout=POLL_INTERVAL_S, return_when=FIRST_COMPLETED)
            for future in sorted(finished, key=Future.cancelled):  # those that were lost recall all that is under way
                if future in self._under_way:
                    self._take_in(future)
                    report()

    def _tasks(self) -> Iterator[FleetTask]:
        """Yield the units that have no result, but for those that have nothing to be computed."""
        after: str | None = None
        while True:
            request = PageRequest[str](limit=UNITS_AT_ONCE, after=after)
            page = self._store.fleet.units(self._job.id, request, "waiting")
            for row in page.rows:
                task = self._task(row.serial)
                result = skipped(self._store, task)
                if result is None:
                    yield task
                else:
                    self._store.fleet.keep(self._job.id, self._request.kind, result, task.at)
            after = page.next_after
            if after is None:
                return

    def _task(self, serial: str) -> FleetTask:
        return FleetTask(serial, self._request, self._clock.utc(), code_digest())

    def _fill(self, left: Iterator[FleetTask]) -> None:
        """Begin as many tasks as the engine has under way; last and alone those during which a worker died."""
        while len(self._under_way) < self._engine.at_once:
            task = next(left, None)
            if task is None:
                if not self._again or (self._under_way and self._tries[self._again[0]]):
                    return
                task = self._task(self._again.popleft())
            try:
                under_way = self._engine.submit(task)
            except TooBusy:
                self._again.append(task.serial)
                if not self._under_way:
                    self._clock.sleep(POLL_INTERVAL_S)
                return
            self._under_way[under_way.future] = task, under_way
            if self._tries[task.serial]:
                return

    def _take_in(self, future: Future[Outcome]) -> None:
        """Write what came of a task. Raises what no other unit would pass by either."""
        task, under_way = self._under_way.pop(future)
        under_way.leave()
        try:
            outcome = future.result()
        except CancelledError:  # the engine was lost with all that it had
            self._recall(task.serial)
            self._engine.reconnect()
            return
        except (BrokenExecutor, ComputationEnded, MemoryError) as error:
            self._lost(task, error)
            return
        except LabctlError:
            raise
        except Exception as error:  # noqa: BLE001  of the engine: a worker was lost too often
            self._failed(task, f"{type(error).__name__}: {error}")
            return
        self._write(task, outcome)

    def _recall(self, serial: str) -> None:
        """Put a unit and all that is under way back: nothing of it was written."""
        self._again.append(serial)
        self._again.extend(task.serial for task, _ in self._under_way.values())
        self._under_way.clear()

    def _lost(self, task: FleetTask, error: Exception) -> None:
        self._tries[task.serial] += 1
        log.warning(
            "fleet.lost", job=self._job.id, serial=task.serial, tries=self._tries[task.serial], error=str(error)
        )
        if self._tries[task.serial] < TRIES:
            self._again.append(task.serial)
        else:
            self._failed(task, f"its process died or was ended {TRIES} times: {error}")

    def _failed(self, task: FleetTask, reason: str) -> None:
        result = FleetResult(task.serial, "failed", reason=reason)
        self._store.fleet.keep(self._job.id, self._request.kind, result, self._clock.utc())

    def _refuse_lost_source(self, outcome: Outcome) -> None:
        """Raise NotFound or BadInput where the storage is gone: all units that are left would fail by that alone."""
        self._failed_in_a_row = self._failed_in_a_row + 1 if outcome.result.state == "failed" else 0
        if self._failed_in_a_row % FAILED_IN_A_ROW == 1:
            refuse_missing_source(self._request.source)

    def _write(self, task: FleetTask, outcome: Outcome) -> None:
        self._refuse_lost_source(outcome)
        if outcome.fit is None:
            kept = self._store.fleet.keep(self._job.id, self._request.kind, outcome.result, task.at)
            if kept and outcome.estimates is not None and (part := self._evidence.add(task.serial, outcome.estimates)):
                self._store.fleet.keep_evidence(self._job.id, part)
            return
        try:
            self._store.fleet.keep_fit(self._job.id, outcome.result, outcome.fit, task.at)
        except VersionTaken:  # by a single fit of the unit meanwhile
            self._again.append(task.serial)
