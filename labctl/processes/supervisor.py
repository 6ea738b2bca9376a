"""The supervisor: what `labctl serve` runs. It starts the bench process and the web process, and watches both.

It computes nothing and has no database open, so that little can stop it. A process that has ended, or has given no
sign of life for `SILENT_S`, is started again; a bench process starts with the safe state. The end of the supervisor
ends the web process, not the bench process: the next supervisor on the same database takes charge of it.
"""

from __future__ import annotations

import contextlib
import shutil
import signal
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging import ERROR, INFO
from pathlib import Path

from instruments.clock import WallClock
from labctl.errors import BenchSilent, BenchUnconfirmed, Conflict, LabctlError
from labctl.log import get_logger
from labctl.processes import systemd
from labctl.processes.bench_line import BenchLine, bench_process_of
from labctl.processes.children import Child
from labctl.processes.listening import Listening, listening
from labctl.processes.liveness import Elapsed
from labctl.processes.settings import BenchSettings, ServeRequest, WebSettings, ahead_of
from labctl.processes.waker import Waker
from labctl.services.benches.bench_left import BenchLeft
from procedures.execution.signals import ENDING, restore

log = get_logger()

LOOK_S = 0.5
#: A process that gave no sign of life for so long is ended and started again, s.
SILENT_S = 15.0
#: Processes that end so often within a quarter of an hour are not started again.
MOST_RESTARTS, RESTARTS_WITHIN_S = 5, 900.0
#: The web process cuts its requests and ends within this, s.
WEB_END_S = 15.0


@dataclass(frozen=True)
class Ready:
    """Where a service answers, and its processes."""

    url: str
    bench_pid: int
    web_pid: int


class _Restarts:
    """Counts how often something had to be started again lately."""

    def __init__(self) -> None:
        self._age = Elapsed()
        self._at_s: list[float] = []

    def one_more(self, what: str) -> None:
        """Count one. Raises LabctlError when there are too many."""
        now_s = self._age.s
        self._at_s = [at_s for at_s in self._at_s if now_s - at_s < RESTARTS_WITHIN_S] + [now_s]
        if len(self._at_s) > MOST_RESTARTS:
            raise LabctlError(
                f"{what} ended {len(self._at_s)} times within {RESTARTS_WITHIN_S / 60:g} min; labctl stops. Read the "
                "log for the cause, then start labctl again"
            )


def serve_forever(request: ServeRequest, ready: Callable[[Ready], None]) -> str:
    """Serve until interrupted; returns how the bench was left, nothing where there is none.

    Raises BadInput for an address that others can reach while there is no key to ask them for, Conflict, BadBench, and
    BenchUnconfirmed for a bench that at the end is not known to be safe.
    """
    request.check()
    with listening(request.host, request.port) as at, ending_signals() as waker:
        left = Supervisor(request, at, waker).run(ready)
    log.log(ERROR if left.unconfirmed else INFO, "process.ended", left=left.text, unconfirmed=left.unconfirmed)
    if left.unconfirmed:
        raise BenchUnconfirmed(f"stopped; {left.text}")
    return left.text


@contextmanager
def ending_signals() -> Iterator[Waker]:
    """Take the ending signals as the request to end while the block runs; the handlers found are restored."""
    before = {number: signal.getsignal(number) for number in ENDING}
    waker = Waker()
    waker.listen_to(ENDING)
    try:
        yield waker
    finally:
        restore(before)
        waker.close()


class Supervisor:
    """Starts both processes and keeps them running."""

    def __init__(self, request: ServeRequest, at: Listening, waker: Waker) -> None:
        self._request, self._at, self._waker = request, at, waker
        self._ahead = ahead_of(WallClock().utc(), request.simulated_start)
        self._restarts = _Restarts()

    def run(self, ready: Callable[[Ready], None]) -> BenchLeft:
        """Serve until asked to end; returns how the bench was left."""
        self._web = self._new_web()  # both load their modules at the same time
        try:
            bench = self._open_bench()
        except BaseException:
            self._web.kill()
            raise
        self._bench, self._web_heard = bench, Elapsed()
        try:
            self._web.open(self._web_settings())
            self._web_heard.restart()
            log.info("process.started", url=self._at.url, bench_pid=bench.pid, web_pid=self._web.pid)
            ready(Ready(self._at.url, bench.pid, self._web.pid))
            bench.tell("begin")
            systemd.ready()
            self._watch_on()
        finally:
            systemd.stopping()
            left = self._end_bench(self._bench)
            self._end_web()
        return left

    # -- the bench process

    def _settings(self, folder: Path) -> BenchSettings:
        request = self._request
        return BenchSettings(
            request.location, request.bench_name, request.simulate, request.speed, folder, self._at.url,
            request.simulated_start, self._ahead,
        )  # fmt: skip

    def _open_bench(self) -> BenchLine:
        """Take charge of the bench process that outlived its service, or start one.

        One whose supervisor ended while it started holds the database and does not answer yet: it is asked again.
        """
        trying = Elapsed()
        while True:
            if (found := self._find_bench()) is not None:
                return found
            self._folder = Path(tempfile.mkdtemp(prefix="labctl-"))
            try:
                return self._start_bench()
            except Conflict:
                holder = bench_process_of(self._request)
                starting = holder is not None and holder.calls is not None
                if not starting or self._waker.ending or trying.s > SILENT_S:
                    raise
            self._waker.wait(LOOK_S)

    def _find_bench(self) -> BenchLine | None:
        """Take charge of the bench process that outlived its service; None where there is none that answers.

        Raises Conflict while another supervisor is in charge of it.
        """
        holder = bench_process_of(self._request)
        if holder is None or holder.calls is None:
            return None
        with contextlib.suppress(BenchSilent, ProcessLookupError):
            self._folder = Path(holder.calls)
            line = BenchLine(self._settings(self._folder), holder.pid)
            log.info("bench_process.found", child_pid=holder.pid)
            return line
        return None

    def _start_bench(self) -> BenchLine:
        for left_over in self._folder.iterdir():
            left_over.unlink()
        settings = self._settings(self._folder)
        child = Child("labctl.processes.bench_process")
        try:
            child.open(settings)
            return BenchLine(settings, child.pid, child)
        except BaseException:
            child.signal(signal.SIGTERM)
            child.wait(SILENT_S)
            child.kill()
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def _end_bench(self, bench: BenchLine) -> BenchLeft:
        """Let the bench process leave its bench safe, however long that takes; returns how it was left."""
        log.info("process.ending", stopped=self._waker.ending)
        bench.tell("end")
        while not bench.wait(LOOK_S):
            systemd.alive()
            if bench.heard_s > SILENT_S:
                self._kill("bench", bench, bench.heard_s)
        bench.close()
        shutil.rmtree(self._folder, ignore_errors=True)
        if bench.left is not None:
            return bench.left
        text = "the bench process ended without a report: the state of the bench is not known; inspect the bench"
        return BenchLeft(text, unconfirmed=self._request.bench_name is not None)

    # -- the web process

    def _new_web(self) -> Child:
        return Child("labctl.processes.web_process", pass_fds=[self._at.socket.fileno()])

    def _web_settings(self) -> WebSettings:
        return WebSettings(self._request, self._folder, self._at.socket.fileno(), self._at.name, self._ahead)

    def _end_web(self) -> None:
        self._web.signal(signal.SIGTERM)
        self._web.wait(WEB_END_S)
        self._web.kill()

    # -- watching

    @staticmethod
    def _kill(name: str, process: BenchLine | Child, silent_s: float) -> None:
        log.error("child.silent", child=name, child_pid=process.pid, silent_s=round(silent_s, 1))
        process.signal(signal.SIGKILL)

    def _watch_on(self) -> None:
        try:
            self._watch()
        except LabctlError as error:
            log.critical("process.gives_up", reason=str(error))
            raise

    def _watch(self) -> None:
        notified = Elapsed()
        while not self._waker.ending:
            self._waker.wait(LOOK_S)
            self._look_after_bench()
            self._look_after_web()
            if notified.s > systemd.period_s():
                notified.restart()
                systemd.alive()

    def _look_after_bench(self) -> None:
        if self._bench.heard_s > SILENT_S:
            self._kill("bench", self._bench, self._bench.heard_s)
        if not self._bench.wait(0.0) or self._waker.ending:
            return
        log.error("child.ended", child="bench", child_pid=self._bench.pid)
        self._bench.close()
        self._restarts.one_more("the bench process")
        self._bench = self._start_bench()
        log.warning("child.restarted", child="bench", child_pid=self._bench.pid)
        self._bench.tell("begin")

    def _look_after_web(self) -> None:
        while self._web.line.poll(0):
            try:
                self._web.line.recv()
            except (EOFError, OSError):
                break
            self._web_heard.restart()
        if self._web_heard.s > SILENT_S:
            self._kill("web", self._web, self._web_heard.s)
        if not self._web.has_ended() or self._waker.ending:
            return
        log.error("child.ended", child="web", child_pid=self._web.pid, status=self._web.status)
        self._web.kill()
        self._restarts.one_more("the web process")
        self._web, self._web_heard = self._new_web(), Elapsed()
        try:
            self._web.open(self._web_settings())
        except (LabctlError, OSError) as error:  # it is looked after again
            log.warning("child.refused", child="web", error=str(error))
        else:
            log.warning("child.restarted", child="web", child_pid=self._web.pid)
