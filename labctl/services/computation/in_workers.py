"""Computations in worker processes: one process for each, bounded in number, memory and time, ended at once.

The processes come from a fork server, which has loaded the libraries once and inherits nothing that is open here: a
worker begins in some 30 ms with no connection, no file and no lock of the service.
"""

from __future__ import annotations

import multiprocessing
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import forkserver
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess

from instruments.clock import Clock
from labctl.errors import ComputationEnded, LabctlError
from labctl.log import get_logger
from labctl.log.context import for_request
from labctl.log.rendering import error_fields
from labctl.progress import Cancelled
from labctl.services.computation.in_threads import result_here
from labctl.services.computation.job import Job
from labctl.services.computation.limits import Limits
from labctl.services.computation.pool import ENDS, Pool
from labctl.services.computation.worker import Outcome, Stage, Task, carry_out
from labctl.store import Store, StoreAddress

log = get_logger()

#: `multiprocessing` looks after all processes whenever one is started: not from two threads at a time.
_processes = threading.Lock()
#: How long a worker that has sent its result may take to end, s.
END_S = 5.0
#: A service that has just started has other work than to load libraries that may never be needed, s.
PRELOAD_AFTER_S = 15.0


class InWorkers(Pool):
    """Each job in a process of its own, which opens the store by its address.

    Jobs that write run in this process, with its own store, where the address names no process that writes for others.
    """

    def __init__(
        self,
        store: Store,
        limits: Limits | None = None,
        *,
        address: StoreAddress | None = None,
        preload: Sequence[str] = (),
        clock: Clock | None = None,
    ) -> None:
        """The fork server loads the modules of `preload` with the first job, or `PRELOAD_AFTER_S` from now."""
        super().__init__(limits or Limits(), clock)
        self._store = store
        self._address = address or store.address
        self._workers: dict[Job, ForkServerProcess] = {}
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload([*preload])
        self._preloading = threading.Timer(PRELOAD_AFTER_S, self._preload)
        self._preloading.daemon = True
        self._preloading.start()

    @staticmethod
    def _preload() -> None:
        with _processes:
            forkserver.ensure_running()

    def _result_of(self, job: Job) -> object:
        if job.writes and not self._address.can_write:
            return result_here(job, self._store)
        task = Task(job.call, self._address, job.actor, self.limits, request_id=job.request_id)
        receiving, sending = self._context.Pipe(duplex=False)
        worker = self._context.Process(target=carry_out, args=(sending, task), name="labctl worker", daemon=True)
        with receiving:
            with sending, _processes:
                worker.start()
            self._workers[job] = worker
            job.end_with(worker.kill)
            with for_request(job.request_id), self._logged(job, worker):
                try:
                    if self._closed:
                        raise ComputationEnded(ENDS)
                    return self._heard(job, worker, receiving)
                finally:
                    self._workers.pop(job, None)
                    self._leave_nothing(worker)

    @contextmanager
    def _logged(self, job: Job, worker: ForkServerProcess) -> Iterator[None]:
        """Log the start and the end of a worker, which is killed when it has said what came of its work."""
        begun_s, about = self._clock.now_s(), {"worker": worker.pid, "work": job.call.work.__name__}
        log.info("worker.started", **about, by=job.actor.name)
        try:
            yield
        except Cancelled:
            log.info("worker.ended", **about, took_s=round(self._clock.now_s() - begun_s, 2), outcome="cancelled")
            raise
        except LabctlError as error:
            failure = error_fields(error)
            log.warning("worker.ended", **about, took_s=round(self._clock.now_s() - begun_s, 2), **failure)
            raise
        except Exception as error:
            log.error("worker.failed", **about, took_s=round(self._clock.now_s() - begun_s, 2), exc_info=error)
            raise
        log.info("worker.ended", **about, took_s=round(self._clock.now_s() - begun_s, 2), outcome="done")

    def _heard(self, job: Job, worker: ForkServerProcess, receiving: Connection) -> object:
        """Return what a worker sends in the end; its stages are reported on the way."""
        deadline_s = self._clock.now_s() + self.limits.deadline_s
        while True:
            ready = wait([receiving, worker.sentinel], max(deadline_s - self._clock.now_s(), 0.0))
            if not ready:
                raise ComputationEnded(
                    f"the computation was ended after {self.limits.deadline_s:g} s, the limit of one computation; "
                    "request less at a time: a recording with fewer data sets, or fewer effects to compare"
                )
            try:
                message = receiving.recv() if receiving.poll() else None
            except (EOFError, OSError):  # it died, perhaps while it sent
                message = None
            if isinstance(message, Outcome):
                return message.result()
            if not isinstance(message, Stage):
                raise self._died(job, worker)
            job.report(message.text)

    def _died(self, job: Job, worker: ForkServerProcess) -> Exception:
        """Return the error of a worker that ended without a result."""
        if job.is_abandoned:
            return Cancelled("its clients have disconnected")
        if self._closed:
            return ComputationEnded(ENDS)
        with _processes:
            worker.join(END_S)
            code = worker.exitcode
        return ComputationEnded(
            f"the computation was ended: its process {_end_in_words(code)} before it had a result. Try again; if "
            f"this happens again, use a recording of fewer data sets (memory limit {self.limits.memory_mib} MiB)"
        )

    @staticmethod
    def _leave_nothing(worker: ForkServerProcess) -> None:
        """End a worker that has nothing more to say."""
        worker.kill()
        with _processes:
            worker.join()

    def _end_all(self) -> None:
        """Kill every worker; what waits is refused by its thread."""
        self._preloading.cancel()
        for worker in list(self._workers.values()):
            worker.kill()


def _end_in_words(code: int | None) -> str:
    if code is None or code >= 0:
        return f"ended (status {code})"
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    short = ", as the operating system does when memory is short" if -code == signal.SIGKILL else ""
    return f"was killed ({name}{short})"
