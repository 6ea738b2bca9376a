"""A bounded pool: so many jobs at once, so many more that wait for their turn, first come first served."""

from __future__ import annotations

import math
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, TypeVar

from instruments.clock import Clock, SystemClock
from labctl.errors import ComputationEnded, TooBusy
from labctl.progress import Cancelled, Progress, progress
from labctl.services.computation.computation import NONE, Work
from labctl.services.computation.job import Call, Job, Pending
from labctl.services.computation.limits import Limits

T = TypeVar("T")

#: How many durations the estimate for `Retry-After` is made from, and what is taken for one before the first, s.
REMEMBERED, FIRST_GUESS_S = 16, 5.0
LONGEST_RETRY_S = 300
WAITING = "waiting for earlier computations: {n}"
ENDS = "the service is stopping; try again when it runs again"


def _ignore(_stage: str) -> None:
    """Discard a stage."""


class Pool(ABC):
    """Attends to every job in a thread of its own, which ends with the queue; how a job is done is up to a subclass."""

    def __init__(self, limits: Limits, clock: Clock | None = None) -> None:
        self.limits = limits
        self._clock = clock or SystemClock()
        self._guard = threading.Lock()
        self._waiting: deque[Job] = deque()
        self._attended: dict[Job, threading.Thread] = {}
        self._by_key: dict[str, Job] = {}
        self._durations_s: deque[float] = deque(maxlen=REMEMBERED)
        self._closed = False

    @abstractmethod
    def _result_of(self, job: Job) -> Any:
        """Do a job. Raises what its work raises, ComputationEnded, Cancelled."""

    def run(self, work: Work[..., T], *args: object, writes: bool = False) -> T:
        """Return the result of some work; its stages are reported as those of this thread."""
        pending = self.submit(work, *args, progress=progress(), writes=writes)
        try:
            return pending.future.result()
        finally:
            pending.leave()

    def submit(
        self,
        work: Work[..., T],
        *args: object,
        named: Mapping[str, object] = NONE,
        progress: Progress | None = None,
        key: str = "",
        writes: bool = False,
    ) -> Pending[T]:
        """Begin some work, or let it wait for its turn, or join what is under way with the same key. Raises TooBusy."""
        heard, call = progress or _ignore, Call(work, args, dict(named))
        with self._guard:
            if self._closed:
                raise ComputationEnded(ENDS)
            under_way = self._by_key.get(key) if key else None
            if under_way is not None:
                joined: Pending[T] = Pending(under_way, heard, self._drop, same=under_way.call == call)
                if under_way.join(joined):
                    return joined
            job = Job(call, key, writes=writes)
            pending: Pending[T] = Pending(job, heard, self._drop, same=True)
            job.join(pending)
            ahead = self._take(job)
            if key:
                self._by_key[key] = job
        if ahead:
            heard(WAITING.format(n=ahead))
        return pending

    def _take(self, job: Job) -> int:
        """Begin a job or put it into the queue; returns how many are before it. Raises TooBusy."""
        if len(self._attended) < self.limits.at_once:
            thread = threading.Thread(target=self._attend, args=(job,), name="labctl computation", daemon=True)
            self._attended[job] = thread
            thread.start()
            return 0
        if len(self._waiting) >= self.limits.waiting:
            wait_s = self._retry_after_s()
            raise TooBusy(
                f"{len(self._attended)} computations are running and {len(self._waiting)} are waiting, which is "
                f"the limit of this service; try again in about {wait_s} s",
                retry_after_s=wait_s,
            )
        self._waiting.append(job)
        return len(self._waiting)

    def _retry_after_s(self) -> int:
        """Return in how many seconds, by the durations of recent jobs, all jobs that wait now will have begun."""
        durations_s = self._durations_s or [FIRST_GUESS_S]
        wait_s = sum(durations_s) / len(durations_s) * max(len(self._waiting), 1) / self.limits.at_once
        return min(max(math.ceil(wait_s), 1), LONGEST_RETRY_S)

    def _attend(self, job: Job) -> None:
        """Do a job, then those that wait; the thread ends with the queue."""
        following: Job | None = job
        while following is not None:
            following = self._done(following)

    def _done(self, job: Job) -> Job | None:
        """Do a job to its end; returns the next one, if there is any."""
        begun_s, result, error = self._clock.now_s(), None, None
        try:
            if job.is_abandoned:
                raise Cancelled(WAITING)
            if self._closed:
                raise ComputationEnded(ENDS)
            result = self._result_of(job)
        except BaseException as raised:  # noqa: BLE001  the waiting caller gets the error
            error = raised
        with self._guard:
            if not isinstance(error, Cancelled):
                self._durations_s.append(self._clock.now_s() - begun_s)
            thread = self._attended.pop(job)
            self._forget(job)
            following = self._waiting.popleft() if self._waiting else None
            if following is not None:
                self._attended[following] = thread
        if error is not None:
            job.future.set_exception(error)
        else:
            job.future.set_result(result)
        return following

    def _forget(self, job: Job) -> None:
        if self._by_key.get(job.key) is job:
            del self._by_key[job.key]

    def _drop(self, job: Job) -> None:
        """Remove a job that no caller waits for from the queue."""
        with self._guard:
            self._forget(job)
            with suppress(ValueError):
                self._waiting.remove(job)

    def end_soon(self) -> None:
        """End what is under way, take on nothing more; returns at once. No lock: a signal's handler may call it."""
        self._closed = True
        self._end_all()

    def close(self) -> None:
        """End what is under way, take on nothing more; returns when all threads have ended."""
        self.end_soon()
        with self._guard:
            attending = list(self._attended.values())
        for thread in attending:
            thread.join()

    @abstractmethod
    def _end_all(self) -> None:
        """End the jobs that are under way, where that is possible; what waits is refused by its thread."""
