"""The supervisor's side of a bench process: one that it has started, or one that outlived its service."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import socket
import threading
from multiprocessing.connection import Connection
from multiprocessing.reduction import send_handle
from typing import NoReturn

from instruments.clock import WallClock
from labctl.errors import BenchSilent, LabctlError
from labctl.log import get_logger
from labctl.processes.children import Child
from labctl.processes.documents import receive, value_of
from labctl.processes.liveness import Silence
from labctl.processes.rpc import RpcClient
from labctl.processes.rpc_methods import supervisor_method
from labctl.processes.settings import CALLS, BenchSettings, ServeRequest
from labctl.processes.supervision import SAID_BY_BENCH, SAID_BY_SUPERVISOR, SupervisorWord
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.benches.lease import driver_of, this_machine
from labctl.services.planning.loading import load_bench
from labctl.store import Holder, holder_of, is_url, open_store

log = get_logger()

ANSWER_S = 10.0
#: On a busy computer a bench process may be silent so much longer, for as long as it gets no processor, s.
EXCUSED_S = 7.0


class BenchLine:
    """A bench process that this supervisor is in charge of."""

    def __init__(
        self, settings: BenchSettings, pid: int, child: Child | None = None, listener: socket.socket | None = None
    ) -> None:
        """Take charge, and hand over the socket that the service listens at.

        Raises Conflict while another supervisor is in charge, or for another bench; BenchSilent.

        A process that accepts the call and does not answer within `ANSWER_S` is ended: it hangs, perhaps with a table
        that turns, and the next one begins with the safe state.
        """
        self.pid, self._child = pid, child
        self._handle = os.pidfd_open(pid)
        self._closed = False
        self.left: BenchLeft | None = None  #: how the bench was left, once the process has said so
        try:
            self._line = self._take_charge(settings)
        except BaseException:
            os.close(self._handle)
            raise
        self.at_rest = False  #: whether the table was known to stand when it answered last
        if listener is not None:
            with contextlib.suppress(OSError):  # it has ended, which is noticed by itself
                self._line.send_bytes(SAID_BY_SUPERVISOR.encode("listener"))
                send_handle(self._line, listener.fileno(), pid)
        self._heard = Silence(pid, EXCUSED_S)
        self._thread = threading.Thread(target=self._hear, name="bench-line", daemon=True)
        self._thread.start()

    def _take_charge(self, settings: BenchSettings) -> Connection:
        line = RpcClient(settings.folder / CALLS, ANSWER_S, supervisor_method).connect()
        try:
            line.send_bytes(supervisor_method("supervise").call(settings))
            if not line.poll(ANSWER_S):
                self._end_silent()
            reply = receive(line)
        except (EOFError, OSError) as error:
            line.close()
            raise BenchSilent(
                f"the bench process {self.pid} ended before it answered ({error or type(error).__name__}); read the "
                "log for the cause, then start the service again"
            ) from error
        except BaseException:
            line.close()
            raise
        try:
            value_of(SAID_BY_BENCH, reply)
        except Exception:
            line.close()
            raise
        return line

    def _end_silent(self) -> NoReturn:
        """End a process that does not answer, so that another one can drive the bench. Raises BenchSilent."""
        log.error("child.silent", child="bench", child_pid=self.pid, silent_s=ANSWER_S)
        self.signal(signal.SIGKILL)
        select.select([self._handle], [], [], ANSWER_S)
        raise BenchSilent(
            f"the bench process {self.pid} has not answered within {ANSWER_S:g} s and was ended; start the "
            "service again, and read the log for the cause"
        )

    def _hear(self) -> None:
        with contextlib.suppress(EOFError, OSError, LabctlError):  # what it cannot say counts as its silence
            while True:
                message = value_of(SAID_BY_BENCH, receive(self._line))
                self._heard.restart()
                self.at_rest = message == "at rest"
                if isinstance(message, BenchLeft):
                    self.left = message

    @property
    def heard_s(self) -> float:
        """Time since its last answer, without that in which the computer did not let it run, s."""
        return self._heard.s

    def excuse(self) -> None:
        """Count its silence from now on: this process itself was late."""
        self._heard.restart()

    def tell(self, what: SupervisorWord) -> None:
        """Say `begin` or `end`, or `beat`: that the guardian lives."""
        with contextlib.suppress(OSError):
            self._line.send_bytes(SAID_BY_SUPERVISOR.encode(what))

    def wait(self, seconds: float) -> bool:
        """Wait for its end; returns whether it came."""
        if self._closed:
            return True
        ended = bool(select.select([self._handle], [], [], seconds)[0])
        if ended and self._child is not None:
            self._child.wait(seconds)
        return ended

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal, unless it is over."""
        with contextlib.suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, number)

    def close(self) -> None:
        """Forget a process that has ended. Safe to call twice."""
        if self._closed:
            return
        self._closed = True
        self._thread.join()
        self._line.close()
        os.close(self._handle)
        if self._child is not None:
            self._child.kill()


def bench_process_of(request: ServeRequest) -> Holder | None:
    """Return who holds the database; on a server, which no process holds, who drives the bench from this machine.

    None where no process does. Raises BadBench, StoreError.
    """
    if not is_url(request.location):
        return holder_of(request.location)
    if request.bench_name is None:
        return None
    with open_store(request.location, write=False) as store:
        driver = driver_of(store, load_bench(request.bench_name).name, WallClock().utc())
    if driver is None or driver.machine != this_machine():
        return None
    return Holder(driver.pid, driver.url, calls=driver.calls)
