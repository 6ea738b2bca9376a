"""Computations in the threads of this process, with its own store: for tests, and for a service without workers."""

from __future__ import annotations

from typing import TypeVar

from labctl.acting_user import acting
from labctl.progress import reporting_to
from labctl.services.computation.computation import Work
from labctl.services.computation.job import Job
from labctl.services.computation.limits import Limits
from labctl.services.computation.pool import Pool
from labctl.store import Store

T = TypeVar("T")
#: As many as a server had threads for requests; nothing is refused.
UNBOUNDED = Limits(at_once=40, waiting=1_000_000)


class InThreads(Pool):
    """Work is done in a thread; a job that no caller waits for ends at its next stage."""

    def __init__(self, store: Store, limits: Limits = UNBOUNDED) -> None:
        super().__init__(limits)
        self._store = store

    def run(self, work: Work[..., T], *args: object, writes: bool = False) -> T:  # noqa: ARG002  this store is written to
        """Return the result of some work, done in the calling thread."""
        return work(self._store, *args)

    def _result_of(self, job: Job) -> object:
        return result_here(job, self._store)

    def end_soon(self) -> None:
        """Go on: a thread cannot be ended, and a test may ask a service that was closed."""

    def _end_all(self) -> None:
        """End nothing."""


def result_here(job: Job, store: Store) -> object:
    """Do a job in this thread, in the name of the caller. Raises Cancelled at a stage, when all have left."""
    with acting(job.actor), reporting_to(job.report):
        return job.call(store)
