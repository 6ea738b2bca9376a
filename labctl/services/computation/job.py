"""One piece of work, and the clients that wait for it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from labctl.acting_user import actor
from labctl.log.context import request_id
from labctl.progress import Cancelled, Progress
from labctl.store import Store

T = TypeVar("T")


@dataclass(frozen=True)
class Call:
    """A function of a module, whose first parameter is a store, and the arguments after it; equal by value."""

    work: Callable[..., object]
    args: tuple[object, ...]
    named: Mapping[str, object]

    def __call__(self, store: Store) -> object:
        """Return what the function returns."""
        return self.work(store, *self.args, **self.named)


class Client(Protocol):
    """Who waits for a job."""

    @property
    def progress(self) -> Progress:
        """Report a stage; raises Cancelled once no caller waits for the result."""
        ...


class Job:
    """Some work on a store, done once for all who wait for it; it is ended when the last of them leaves."""

    def __init__(self, call: Call, key: str, *, writes: bool) -> None:
        self.call, self.key, self.writes = call, key, writes
        self.actor, self.request_id = actor(), request_id()
        self.future: Future[Any] = Future()
        self.future.set_running_or_notify_cancel()  # a waiting caller cannot cancel it for the others
        self._guard = threading.Lock()
        self._waiting: list[Client] = []
        self._stage = ""
        self._end: Callable[[], None] | None = None
        self.is_abandoned = False

    def join(self, client: Client) -> bool:
        """Add a waiting client and report the stage to it; False where the job is ending because all have left."""
        with self._guard:
            if self.is_abandoned:
                return False
            self._waiting.append(client)
            stage = self._stage
        if stage:
            client.progress(stage)
        return True

    def leave(self, client: Client) -> None:
        """Remove a waiting client; the last one ends the job at once, where it can be ended."""
        with self._guard:
            if client not in self._waiting:
                return
            self._waiting.remove(client)
            if self._waiting or self.future.done():
                return
            self.is_abandoned = True
            end = self._end
        if end is not None:
            end()

    def end_with(self, end: Callable[[], None]) -> None:
        """Set how the job is ended at once; called now where it is abandoned already."""
        with self._guard:
            self._end = end
            abandoned = self.is_abandoned
        if abandoned:
            end()

    def report(self, stage: str) -> None:
        """Report a stage to all waiting callers. Raises Cancelled where no caller waits any more."""
        with self._guard:
            self._stage = stage
            waiting = list(self._waiting)
        for client in waiting:
            try:
                client.progress(stage)
            except Cancelled:
                self.leave(client)
        if self.is_abandoned:
            raise Cancelled(stage)


class Pending(Generic[T]):
    """The place of one client at a job."""

    def __init__(self, job: Job, progress: Progress, drop: Callable[[Job], None], *, same: bool) -> None:
        self.progress = progress
        self.same = same  #: whether the result is that of the work asked for, or of other work at the same question
        self._job, self._drop = job, drop

    @property
    def future(self) -> Future[T]:
        """The result; it raises what the work raised, ComputationEnded, or Cancelled where all have left."""
        return self._job.future

    def leave(self) -> None:
        """Wait no more; a job that no caller waits for is ended. Without effect on a job that is done."""
        self._job.leave(self)
        if self._job.is_abandoned:
            self._drop(self._job)
