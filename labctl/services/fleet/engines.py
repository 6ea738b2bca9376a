"""Engines that do the tasks of a job: processes of this computer, or a cluster of Dask."""

from __future__ import annotations

import logging
from concurrent.futures import Future
from pathlib import Path
from typing import Protocol

from labctl.errors import BadInput, ComputationEnded
from labctl.extras import needs_extra
from labctl.services.computation import Computation, Limits
from labctl.services.fleet.processes import ProcessEngine
from labctl.services.fleet.source import Source
from labctl.services.fleet.task import FleetTask, Outcome, perform
from labctl.store import StoreAddress, is_url

LOCAL, DASK, SCHEME = "local", "dask", "dask://"
#: Tasks that are sent to a cluster for each of its threads, so that none waits for the next one.
AHEAD = 2
#: How long a scheduler is waited for at first, and one that was lost, s.
CONNECT_S, RECONNECT_S = 10.0, 60.0


class UnderWay(Protocol):
    """A task that was begun."""

    @property
    def future(self) -> Future[Outcome]:
        """The result; it raises ComputationEnded where the worker died, CancelledError where the engine was lost."""
        ...

    def leave(self) -> None:
        """End the task; its result is not wanted any more."""
        ...


class Engine(Protocol):
    """Does tasks, several at once."""

    @property
    def at_once(self) -> int:
        """How many tasks to have under way."""
        ...

    def submit(self, task: FleetTask) -> UnderWay:
        """Begin a task. Raises TooBusy."""
        ...

    def reconnect(self) -> None:
        """Make the engine usable again after its tasks were lost. Raises ComputationEnded where it cannot be."""
        ...

    def close(self) -> None:
        """Release the engine."""
        ...


class ComputationEngine:
    """Tasks are done by a computation that is there already, such as the threads of a test."""

    def __init__(self, computation: Computation, at_once: int) -> None:
        self._computation, self.at_once = computation, at_once

    def submit(self, task: FleetTask) -> UnderWay:
        """Begin a task. Raises TooBusy."""
        return self._computation.submit(perform, task)

    def reconnect(self) -> None:
        """Raise ComputationEnded: only a computation that is ended loses tasks."""
        raise ComputationEnded("the computation was ended; start the job again, units that are done are skipped")

    def close(self) -> None:
        """Leave the computation to the process that has it."""


class _ClusterTask:
    """A task on a cluster."""

    def __init__(self, future: Future[Outcome]) -> None:
        self.future = future

    def leave(self) -> None:
        self.future.cancel()


class DaskEngine:
    """Tasks are done by a cluster of Dask, which gives those of a lost worker to another one."""

    def __init__(self, address: str, source: Source) -> None:
        """`address` is dask (a cluster on this computer) or dask://HOST:PORT. Raises BadInput, ComputationEnded."""
        with needs_extra("fleet", f"the engine {address}"):
            import distributed  # noqa: PLC0415  of the extra `fleet`

        logging.getLogger("distributed").setLevel(logging.CRITICAL)  # a job says itself what it has lost
        self._distributed, self._source = distributed, source
        self._address = None if address == DASK else f"tcp://{address.removeprefix(SCHEME)}"
        self._open(CONNECT_S)

    def _open(self, within_s: float) -> None:
        try:
            if self._address is None:
                self._client = self._distributed.Client(threads_per_worker=1, dashboard_address=None)
            else:
                self._client = self._distributed.Client(self._address, timeout=within_s)
            self._client.wait_for_workers(1, timeout=within_s)
        except (OSError, TimeoutError) as error:
            raise ComputationEnded(
                f"the scheduler at {self._address or 'this computer'} did not answer, or has no worker, within "
                f"{within_s:g} s ({error or type(error).__name__}); start `dask scheduler` and `dask worker` there, "
                "then start the job again: units that are done are skipped"
            ) from error
        self._executor = self._client.get_executor(pure=False)

    @property
    def at_once(self) -> int:
        """How many tasks to have under way: as many as keep the workers busy that there are now."""
        return AHEAD * max(sum(self._client.nthreads().values()), 1)

    def submit(self, task: FleetTask) -> UnderWay:
        """Begin a task."""
        return _ClusterTask(self._executor.submit(perform_from, self._source, task))

    def reconnect(self) -> None:
        """Connect to the scheduler again, also to one that was started anew. Raises ComputationEnded."""
        self.close()
        self._open(RECONNECT_S)

    def close(self) -> None:
        """Leave the cluster; one on this computer ends."""
        self._client.close(timeout=5)


def perform_from(source: Source, task: FleetTask) -> Outcome:
    """Do a task on a worker of a cluster, which opens the store itself."""
    with source.open() as store:
        return perform(store, task)


def open_engine(engine: str, address: StoreAddress, limits: Limits | None = None) -> Engine:
    """Open an engine by its name; its workers read the database at `address`. Raises BadInput, ComputationEnded."""
    refuse_unknown(engine)
    if engine == LOCAL:
        return ProcessEngine(address, limits=limits)
    return DaskEngine(engine, Source(StoreAddress(_everywhere(address.location))))


def _everywhere(location: str) -> str:
    """Return an address of a database that does not depend on the folder of the process."""
    return location if is_url(location) else str(Path(location).absolute())


def refuse_unknown(engine: str) -> None:
    """Raise BadInput for an engine that does not exist."""
    if engine not in {LOCAL, DASK} and not engine.startswith(SCHEME):
        raise BadInput(f"engine {engine!r} is not known; choose {LOCAL}, {DASK} or {SCHEME}HOST:PORT")
