"""Computations in worker processes: one process for each, bounded in number, memory and time, ended at once.

The processes come from a fork server, which has loaded the libraries once and inherits nothing that is open here: a
worker begins in some 30 ms with no connection, no file and no lock of the service.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import resource
import signal
import threading
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import forkserver, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerProcess
from pathlib import Path

from instruments.clock import Clock
from labctl.acting_user import Actor, acting
from labctl.errors import ComputationEnded, LabctlError
from labctl.log import get_logger
from labctl.log.context import for_request
from labctl.log.rendering import error_fields
from labctl.log.setup import present_level, running_log
from labctl.progress import Cancelled, reporting_to
from labctl.services.computation.in_threads import result_here
from labctl.services.computation.job import Call, Job
from labctl.services.computation.limits import Limits
from labctl.services.computation.pool import ENDS, Pool
from labctl.store import Store, StoreAddress

MIB = 1 << 20
#: The process that the system ends first when its memory is short.
FIRST_TO_END = "1000"


@dataclass(frozen=True)
class Task:
    """All that a worker has to know."""

    call: Call
    address: StoreAddress
    actor: Actor
    limits: Limits
    environment: Mapping[str, str] = field(default_factory=lambda: dict(os.environ))
    request_id: str = ""
    log_level: int | None = field(default_factory=present_level)  #: None: the service has no log


@dataclass(frozen=True)
class Stage:
    """A stage that begins now, in words."""

    text: str


@dataclass(frozen=True)
class Outcome:
    """What came of the work, pickled: its result, or the error that it raised."""

    content: bytes
    is_error: bool = False

    def result(self) -> object:
        """Return the result. Raises the error."""
        value = pickle.loads(self.content)  # noqa: S301  made by a process of this service
        if self.is_error:
            raise value
        return value


def carry_out(connection: Connection, task: Task) -> None:
    """Do a task in this process, which has nothing else to do; its stages and its result are sent."""
    os.environ.clear()
    os.environ.update(task.environment)
    for number in (signal.SIGINT, signal.SIGHUP):  # the service decides when it ends
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_the_service, daemon=True).start()
    os.nice(task.limits.niceness)
    with _log_of(task):  # written out before the outcome is sent: the service that has it kills the worker
        bound_memory(task.limits.memory_mib)
        outcome = _outcome(connection, task)
    with suppress(BrokenPipeError):
        connection.send(outcome)


@contextmanager
def _log_of(task: Task) -> Iterator[None]:
    """Log what the libraries say, and uncaught errors; the service itself logs start and end of a worker."""
    if task.log_level is None:
        yield
        return
    with running_log("worker", task.log_level), for_request(task.request_id):
        yield


def _end_with_the_service() -> None:
    service = parent_process()
    if service is not None:
        wait([service.sentinel])
        os._exit(1)


def bound_memory(memory_mib: int) -> None:
    """Bound the address space to what is taken now and so much more; be the first to go where memory is short."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError):  # no /proc here: the bound is then the whole address space
        Path("/proc/self/oom_score_adj").write_text(FIRST_TO_END, encoding="ascii")
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    bound = _address_space() + memory_mib * MIB
    if most == resource.RLIM_INFINITY or bound < most:
        resource.setrlimit(resource.RLIMIT_AS, (bound, most))


def _address_space() -> int:
    """Return how many bytes of address space this process has now; 0 where that cannot be read."""
    with suppress(OSError, ValueError):
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        return pages * resource.getpagesize()
    return 0


def _outcome(connection: Connection, task: Task) -> Outcome:
    def tell(stage: str) -> None:
        connection.send(Stage(stage))

    try:
        with task.address.open() as store, acting(task.actor), reporting_to(tell):
            return Outcome(pickle.dumps(task.call(store)))
    except MemoryError:
        return _failed(out_of_memory(task.limits))
    except Exception as error:  # noqa: BLE001  the service raises it again
        return _failed(error)


def _failed(error: Exception) -> Outcome:
    """Return an error as an outcome; the service has its traceback as a note, for a log."""
    error.add_note("in a worker:\n" + "".join(traceback.format_exception(error)))
    with suppress(Exception):
        content = pickle.dumps(error)
        pickle.loads(content)  # noqa: S301  some libraries' errors cannot be made again
        return Outcome(content, is_error=True)
    return Outcome(pickle.dumps(RuntimeError("\n".join(error.__notes__))), is_error=True)


def out_of_memory(limits: Limits) -> ComputationEnded:
    """Return the error of a computation that asked for more memory than it may have."""
    return ComputationEnded(
        f"the computation was ended: memory limit {limits.memory_mib} MiB; send less at a time: a recording of "
        "fewer data sets or readings, or fewer points of a picture"
    )


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
