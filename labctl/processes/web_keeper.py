"""Restarts the web process of a service, and answers stops at its address while no web process answers."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable

from labctl.errors import LabctlError
from labctl.log import get_logger
from labctl.processes.children import SAID_BY_CHILD, Child
from labctl.processes.documents import receive, value_of
from labctl.processes.held_address import HeldAddress
from labctl.processes.listening import Listening
from labctl.processes.liveness import Elapsed, Restarts, Silence
from labctl.processes.settings import WebSettings, page_access
from labctl.processes.waker import Waker
from labctl.stop.latch import StopRequest
from labctl.stop.page import BenchNow
from labctl.stop.wire import Stopping

log = get_logger()

CHECK_EVERY_S = 0.25
#: Time without a message of the web process after which the supervisor answers stops at its address, s.
STOPS_ANSWERED_AFTER_S = 2.0
#: Time without a message after which the web process is replaced, s.
SILENT_S = 6.0
#: Extra time on a busy computer while the web process gets no processor time: a new one would get none either, s.
BUSY_EXTRA_S = 60.0
#: Delay of a check above which its result is not used: the supervisor itself did not run, s.
MAX_DELAY_S = 1.0
#: Time within which the web process ends, with its requests, and how much more where it gets no processor, s.
ENDS_WITHIN_S, EXCUSED_S = 4.0, 10.0


class WebKeeper:
    """The web process of a service, which is replaced when it ends or does not answer."""

    def __init__(
        self,
        at: Listening,
        waker: Waker,
        settings: Callable[[], WebSettings],
        respond: Callable[[StopRequest], Stopping],
    ) -> None:
        """Start a process, which loads its modules; `respond` begins a stop that is asked for meanwhile."""
        self._at, self._waker, self._settings = at, waker, settings
        self._address = HeldAddress(respond, lambda: BenchNow("labctl starts its web process again."), relays=True)
        self._restarts = Restarts()
        self._over, self._closed = threading.Event(), threading.Event()
        self._failure: LabctlError | None = None
        self._end_asked = False
        self._thread = threading.Thread(target=self._keep, name="web-keeper", daemon=True)
        self._process = self._new()

    def _new(self) -> Child:
        made = Child("labctl.processes.web_process", pass_fds=[self._at.socket.fileno()])
        self._heard, self._unheard = Silence(made.pid, BUSY_EXTRA_S), Elapsed()
        return made

    @property
    def pid(self) -> int:
        """The process's number."""
        return self._process.pid

    def open(self) -> None:
        """Let the first process answer requests; raises what keeps it from that."""
        self._process.open(self._settings(), lambda: self._waker.ending)
        self._count_from_now()

    def keep(self) -> None:
        """Watch the process from now on, in a thread."""
        self._address.take(self._at.socket.dup())
        self._thread.start()

    def check(self) -> None:
        """Raise LabctlError where the process ended too often."""
        if self._failure is not None:
            raise self._failure

    def end_soon(self) -> None:
        """Ask the process to end; returns at once."""
        if not self._end_asked:
            self._end_asked = True
            self._over.set()
            self._process.signal(signal.SIGTERM)

    def close(self) -> None:
        """End the process, and give the address back."""
        self.end_soon()
        self._process.signal(signal.SIGTERM)
        ending = Silence(self.pid, EXCUSED_S)
        while not self._process.wait(CHECK_EVERY_S):
            if ending.s > ENDS_WITHIN_S:
                log.error("child.silent", child="web", child_pid=self.pid, asked_to_end=True)
                break
        self._process.kill()
        self._closed.set()
        if self._thread.is_alive():
            self._thread.join()
        self._address.give_back()

    def _keep(self) -> None:
        since = Elapsed()
        try:
            while not self._over.wait(CHECK_EVERY_S):
                if since.s > CHECK_EVERY_S + MAX_DELAY_S:
                    self._count_from_now()
                since.restart()
                self._receive()
                self._check_silence()
        except LabctlError as error:
            self._failure = error
            self._waker.end()
        self._closed.wait()  # the kernel kills a web process together with the thread that has started it

    def _receive(self) -> None:
        while self._process.line.poll(0):
            try:
                value_of(SAID_BY_CHILD, receive(self._process.line))
            except (EOFError, OSError):
                return
            except LabctlError as error:  # an unreadable message counts as none
                log.warning("child.unread", child="web", child_pid=self.pid, error=str(error))
                return
            self._count_from_now()
            self._address.close_page()

    def _count_from_now(self) -> None:
        self._heard.restart()
        self._unheard.restart()

    def _check_silence(self) -> None:
        if self._unheard.s > STOPS_ANSWERED_AFTER_S or self._process.has_ended():
            settings = self._settings()
            self._address.open_page(page_access(settings.request.asks_for_keys, settings.at, settings.folder))
        if self._heard.s > SILENT_S:
            log.error("child.silent", child="web", child_pid=self.pid, silent_s=round(self._heard.s, 1))
            self._process.signal(signal.SIGKILL)
            self._process.wait(MAX_DELAY_S)
        if self._process.has_ended() and not self._over.is_set():
            self._start_again()

    def _start_again(self) -> None:
        log.error("child.ended", child="web", child_pid=self.pid, status=self._process.status)
        self._process.kill()
        self._restarts.one_more("the web process")
        self._process = self._new()
        with contextlib.suppress(OSError):
            try:
                self._process.open(self._settings(), self._over.is_set)
            except LabctlError as error:  # it is looked after again
                log.warning("child.refused", child="web", error=str(error))
            else:
                log.warning("child.restarted", child="web", child_pid=self.pid)
        self._count_from_now()
