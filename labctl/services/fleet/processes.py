"""An engine of processes of this computer that stay for many tasks: a task of 0.1 s is not worth a process of its own.

The pool is that of `concurrent.futures`; its processes come from a fork server, are bounded in memory, and end with
the process that made them or when the engine is closed.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from types import FrameType

from labctl.errors import ComputationEnded
from labctl.services.computation import Limits
from labctl.services.computation.in_workers import bound_memory
from labctl.services.fleet.task import FleetTask, Outcome, perform
from labctl.store import StoreAddress

#: A process does so many tasks, so that what libraries keep is released.
TASKS_OF_A_PROCESS = 500
#: Tasks under way for each process, so that none waits for the next one.
AHEAD = 2


class _PoolTask:
    """A task of the pool."""

    def __init__(self, future: Future[Outcome]) -> None:
        self.future = future

    def leave(self) -> None:
        """Do not begin the task; one that was begun goes on until the engine is closed."""
        self.future.cancel()


class ProcessEngine:
    """Tasks are done by `processes` processes of this computer, which read the store by its address."""

    def __init__(self, address: StoreAddress, processes: int | None = None, limits: Limits | None = None) -> None:
        self._limits = limits or Limits()
        self._address, self._processes = address, processes or self._limits.at_once
        self._open()

    def _open(self) -> None:
        context = multiprocessing.get_context("forkserver")
        theirs, self._line = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(
            self._processes, mp_context=context, initializer=_begin, initargs=(theirs, self._limits),
            max_tasks_per_child=TASKS_OF_A_PROCESS,
        )  # fmt: skip
        self._theirs = theirs

    @property
    def at_once(self) -> int:
        """How many tasks to have under way."""
        return AHEAD * self._processes

    def submit(self, task: FleetTask) -> _PoolTask:
        """Begin a task; the pool is made again where a process of it died."""
        try:
            future = self._pool.submit(perform_here, self._address, task, self._limits.deadline_s)
        except BrokenProcessPool:
            self.reconnect()
            future = self._pool.submit(perform_here, self._address, task, self._limits.deadline_s)
        return _PoolTask(future)

    def reconnect(self) -> None:
        """Make the processes anew."""
        self.close()
        self._open()

    def close(self) -> None:
        """End the processes at once."""
        self._line.close()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._theirs.close()


def _begin(line: Connection, limits: Limits) -> None:
    """Prepare a process: the coordinator decides when it ends, and other work of the computer comes first."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with, args=(line,), daemon=True).start()
    os.nice(limits.niceness)
    bound_memory(limits.memory_mib)


def _end_with(line: Connection) -> None:
    """End this process with its parent, or when the other end of the line is closed."""
    parent = parent_process()
    wait([line, *([] if parent is None else [parent.sentinel])])
    os._exit(1)


def perform_here(address: StoreAddress, task: FleetTask, deadline_s: float) -> Outcome:
    """Do a task in a process of the pool, which opens the store itself. Raises ComputationEnded after the deadline."""

    def end(_number: int, _frame: FrameType | None) -> None:
        raise ComputationEnded(
            f"the computation was ended after {deadline_s:g} s, the limit of one unit; use a recording with fewer data "
            "sets"
        )

    signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, deadline_s)
    try:
        with address.open() as store:
            return perform(store, task)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
