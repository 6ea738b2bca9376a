"""A job in the foreground of a command: where no service holds the database."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable

from instruments.clock import Clock, SystemClock
from labctl.answers.fleet import FleetJobRequest, FleetJobResponse
from labctl.config import default_database
from labctl.services.fleet.engines import Engine, open_engine
from labctl.services.fleet.jobs import begin, job_answer
from labctl.services.fleet.runner import carry_out
from labctl.store import Store, open_store

LEFT = "its process ended; start it again, units that are done are skipped"


def this_process() -> str:
    """Return what this process is called as the runner of jobs."""
    return f"{socket.gethostname()} process {os.getpid()}"


def run_here(
    database: str | None, request: FleetJobRequest, told: Callable[[FleetJobResponse], None] = lambda _: None
) -> FleetJobResponse:
    """Carry out a job in this process to its end. Raises LabctlError."""
    with open_store(database or default_database(), write=True) as store:
        clock = SystemClock()
        _end_those_left(store, clock)
        return run_with(store, clock, request, lambda: open_engine(request.engine, store.address), told)


def run_with(
    store: Store,
    clock: Clock,
    request: FleetJobRequest,
    make_engine: Callable[[], Engine],
    told: Callable[[FleetJobResponse], None] = lambda _: None,
) -> FleetJobResponse:
    """Carry out a job with the engine that is made for it. Raises LabctlError."""
    runner = this_process()
    job = begin(store, request, clock.utc(), runner).id
    carry_out(store, clock, job, runner, make_engine, lambda: told(job_answer(store, job, clock.utc())))
    return job_answer(store, job, clock.utc())


def _end_those_left(store: Store, clock: Clock) -> None:
    """Write down that the jobs of processes that were killed have ended: no other process can have one."""
    if store.is_sole_writer:
        for row in store.fleet.open():
            store.fleet.end(row.id, row.runner, "failed", LEFT, clock.utc())
