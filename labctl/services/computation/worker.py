"""The worker: a process that does one piece of work with limits of its own, and sends back its result."""

from __future__ import annotations

import os
import pickle
import resource
import signal
import threading
import traceback
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path

from labctl.acting_user import Actor, acting
from labctl.errors import ComputationEnded
from labctl.log.context import for_request
from labctl.log.setup import present_level, running_log
from labctl.progress import reporting_to
from labctl.services.computation.job import Call
from labctl.services.computation.limits import Limits
from labctl.store import StoreAddress

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
        found = pickle.loads(self.content)  # noqa: S301  made by a process of this service
        if self.is_error:
            raise found
        return found


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
        _bound_memory(task.limits.memory_mib)
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


def _bound_memory(memory_mib: int) -> None:
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
