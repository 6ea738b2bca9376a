"""The supervisor: what `labctl serve` runs. It starts the bench process and the web process, and watches both.

It computes nothing and has no database open, so that little can stop it. A process that has ended, or has given no
sign of life for some seconds, is started again. As the guardian of the bench it stops the instruments through their
drivers as soon as a bench process has ended without having done so. The end of the supervisor ends the web process, not
the bench process: the next supervisor on the same database takes charge of it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging import ERROR, INFO
from pathlib import Path

from instruments.clock import WallClock
from labctl.config import os_user
from labctl.errors import BenchSilent, BenchUnconfirmed, Conflict, LabctlError
from labctl.log import get_logger
from labctl.processes import systemd
from labctl.processes.bench_line import EXCUSED_S, BenchLine, bench_process_of
from labctl.processes.children import Child
from labctl.processes.guardian import Guardian, GuardianStop
from labctl.processes.listening import Listening, listening
from labctl.processes.liveness import Elapsed, Restarts, Silence
from labctl.processes.rpc import RpcClient
from labctl.processes.rpc_methods import supervisor_method
from labctl.processes.settings import CALLS, BenchSettings, ServeRequest, WebSettings, ahead_of
from labctl.processes.supervisor_watch import is_stopped
from labctl.processes.waker import Waker
from labctl.processes.web_keeper import WebKeeper
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.campaigns.stop_requests import StopElsewhere
from labctl.services.planning.loading import load_bench, with_drivers
from labctl.stop.client import LATCH_S, AttemptedStop, StopAttempt, end_process
from labctl.stop.latch import StopRequest
from labctl.stop.places import BenchPlace, ProcessId, place_of
from labctl.stop.wire import Stopping
from labctl.texts import NO_BENCH
from procedures.execution.signals import ENDING, restore

log = get_logger()

POLL_INTERVAL_S, BEAT_S = 0.25, 0.5
#: A bench process that gave no sign of life for so long is ended, its bench stopped, and another one started, s.
SILENT_S = 3.0
#: A bench process that starts may take this long to answer for the first time, s.
STARTS_WITHIN_S = 15.0
#: A supervisor that was itself so late cannot tell whether another process was silent, s.
LATE_S = 1.0
#: From the request to end to the end of what has not ended by then, s. A bench process whose table is known to stand
#: may take longer: a chamber is asked several times.
ENDS_WITHIN_S, SAFE_WITHIN_S = 5.0, 180.0


@dataclass(frozen=True)
class Ready:
    """Where a service answers, and its processes."""

    url: str
    bench_pid: int | None  #: None for a service that only reads
    web_pid: int
    web_pids: tuple[int, ...]  #: of all web processes


#: A bench process that answers at the address of its service gives it back within this, s.
ADDRESS_S = 3.0


def serve_forever(request: ServeRequest, ready: Callable[[Ready], None]) -> str:
    """Serve until interrupted; returns how the bench was left, nothing where there is none.

    Raises BadInput for an address that others can reach while there is no key to ask them for, Conflict, BadBench, and
    BenchUnconfirmed for a bench that at the end is not known to be safe.
    """
    request.check()
    with listening(request.host, request.port, lambda: _ask_for_address(request)) as at, ending_signals() as waker:
        left = Supervisor(request, at, waker).run(ready)
    log.log(ERROR if left.unconfirmed else INFO, "process.ended", left=left.text, unconfirmed=left.unconfirmed)
    if left.unconfirmed:
        raise BenchUnconfirmed(f"stopped; {left.text}")
    return left.text


def _ask_for_address(request: ServeRequest) -> None:
    """Ask a bench process whose service is gone, and which answers at its address, to give the address back.

    One that does not answer is ended: it would be ended when this service takes charge, and its bench is made safe.
    """
    with contextlib.suppress(LabctlError):
        holder = bench_process_of(request)
        if holder is None or holder.calls is None:
            return
        try:
            RpcClient(Path(holder.calls) / CALLS, ADDRESS_S, supervisor_method).call("address.give_back")
        except BenchSilent:
            log.error("child.silent", child="bench", child_pid=holder.pid, silent_s=ADDRESS_S)
            end_process(ProcessId.of(holder.pid))


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
        self._restarts = Restarts()
        self._bench: BenchLine | None = None
        self._guardian: Guardian | None = None
        self._place: BenchPlace | None = None
        self._end_latched = False

    def run(self, ready: Callable[[Ready], None]) -> BenchLeft:
        """Serve until asked to end; returns how the bench was left."""
        web = WebKeeper(self._at, self._waker, self._web_settings, self._respond)  # both load modules at the same time
        try:
            self._begin_guarding()
            bench = self._bench = self._open_bench()
        except BaseException:
            web.close()
            self._end_guarding()
            raise
        try:
            web.open()
            log.info("process.started", url=self._at.url, bench_pid=bench.pid, web_pid=web.pid)
            ready(Ready(self._at.url, bench.pid, web.pid, (web.pid,)))
            bench.tell("begin")
            web.keep()
            systemd.ready()
            self._watch_on(web)
        finally:
            systemd.stopping()
            left = self._end(web)
        return left

    # -- the guardian of the bench

    def _begin_guarding(self) -> None:
        if self._request.bench_name is None:
            return
        bench = with_drivers(load_bench(self._request.bench_name))  # loads what the guardian needs
        self._place = place_of(self._request.location, bench.name)
        self._guardian = Guardian(bench, self._place, self._end_for_guardian)

    def _end_for_guardian(self) -> str:
        """End the bench process at once, for the guardian; returns what kept it from ending, empty when it is gone."""
        bench = self._bench
        if bench is None or bench.wait(0.0):
            return ""
        log.error("guardian.ends_child", child="bench", child_pid=bench.pid, silent_s=round(bench.heard_s, 1))
        bench.signal(signal.SIGKILL)
        return "" if bench.wait(ENDS_WITHIN_S) else f"the bench process {bench.pid} does not end"

    def _end_guarding(self) -> None:
        if self._guardian is not None:
            self._guardian.close()

    def _respond(self, stop: StopRequest) -> Stopping:
        """Begin a stop that came over HTTP while no web process answered."""
        if self._place is None:
            return StopElsewhere(NO_BENCH, stands=True)
        return AttemptedStop(StopAttempt(self._place, stop))

    def _secure_orphan(self) -> None:
        """Make safe a bench whose process has ended without doing so, before another one starts."""
        note = None if self._place is None else self._place.note()
        if note is not None and not note.left and not note.simulated and not note.driver.lives:
            self._secured()

    def _secured(self) -> GuardianStop | None:
        """Let the guardian make safe the bench of a process that has ended; returns the result."""
        if self._guardian is None:
            return None
        while self._guardian.busy:  # it was asked for a stop, and has ended the process itself
            self._waker.wait(POLL_INTERVAL_S)
        securing = self._guardian.begin()
        while not securing.wait(POLL_INTERVAL_S):
            systemd.alive()
        return securing

    # -- the bench process

    def _settings(self, folder: Path) -> BenchSettings:
        request = self._request
        return BenchSettings(
            request.location, request.bench_name, request.simulate, request.speed, folder, self._at.url,
            request.simulated_start, self._ahead, os.getpid(),
            "" if self._guardian is None else str(self._guardian.socket),
            request.host, self._at.name, request.asks_for_keys,
            None if request.wire_logs is None else request.wire_logs.absolute(),
        )  # fmt: skip

    def _open_bench(self) -> BenchLine:
        """Take charge of the bench process that outlived its service, or start one.

        One whose supervisor ended while it started holds the database and does not answer yet: it is asked again.
        """
        trying = Elapsed()
        while True:
            if (bench := self._find_bench()) is not None:
                return bench
            self._folder = Path(tempfile.mkdtemp(prefix="labctl-"))
            self._secure_orphan()
            try:
                return self._start_bench()
            except Conflict:
                holder = bench_process_of(self._request)
                starting = holder is not None and holder.calls is not None
                if not starting or self._waker.ending or trying.s > STARTS_WITHIN_S:
                    raise
            self._waker.wait(POLL_INTERVAL_S)

    def _find_bench(self) -> BenchLine | None:
        """Take charge of the bench process that outlived its service; None where there is none that answers.

        Raises Conflict while another supervisor is in charge of it.
        """
        holder = bench_process_of(self._request)
        if holder is None or holder.calls is None:
            return None
        with contextlib.suppress(BenchSilent, ProcessLookupError):
            self._folder = Path(holder.calls)
            line = BenchLine(self._settings(self._folder), holder.pid, listener=self._at.socket)
            log.info("bench_process.found", child_pid=holder.pid)
            return line
        return None

    def _start_bench(self) -> BenchLine:
        for left_over in self._folder.iterdir():
            left_over.unlink()
        settings = self._settings(self._folder)
        child = Child("labctl.processes.bench_process")
        try:
            child.open(settings, lambda: self._waker.ending)
            return BenchLine(settings, child.pid, child, self._at.socket)
        except BaseException:
            child.signal(signal.SIGTERM)
            child.wait(ENDS_WITHIN_S)
            child.kill()
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def _end_bench(self, bench: BenchLine, web: WebKeeper) -> BenchLeft:
        """Let the bench process leave its bench safe, or do it in its place; returns how the bench was left."""
        ending = Silence(bench.pid, EXCUSED_S)
        if not bench.at_rest:
            self._latch_end()  # written down first: either process may be killed before it is carried out
        bench.tell("end")
        while not bench.wait(POLL_INTERVAL_S):
            systemd.alive()
            if ending.s > ENDS_WITHIN_S / 2:
                web.end_soon()
            if self._may_take_longer(bench, ending):
                continue
            self._kill_bench(bench, bench.heard_s)
        bench.close()
        shutil.rmtree(self._folder, ignore_errors=True)
        if bench.left is not None:
            return bench.left
        self._latch_end()
        securing = self._secured()
        if securing is None:
            return BenchLeft(f"the bench process ended without a report; {NO_BENCH}")
        text = f"the bench process ended without a report; {securing.text}"
        if not securing.safe:
            text += "; the state of the bench is not known; inspect the bench"
        return BenchLeft(text, unconfirmed=not securing.safe)

    def _may_take_longer(self, bench: BenchLine, ending: Silence) -> bool:
        """Return whether a bench process that was asked to end may go on with that."""
        if bench.heard_s > SILENT_S or is_stopped(bench.pid):
            return False
        at_rest = bench.at_rest and (self._guardian is None or not self._guardian.simulated)
        return ending.s < (SAFE_WITHIN_S if at_rest else ENDS_WITHIN_S)

    def _latch_end(self) -> None:
        """Remember that what runs is to end: the next process would take the campaign up again."""
        if self._place is None or self._end_latched:
            return
        self._end_latched = True
        stop, latch = StopRequest.of_service_end(os_user()), self._place.latch

        def write() -> None:
            with contextlib.suppress(OSError):
                latch.request(stop)

        writing = threading.Thread(target=write, name="latch", daemon=True)
        writing.start()
        writing.join(LATCH_S)  # a disk that stands still does not delay the end

    @staticmethod
    def _kill_bench(bench: BenchLine, silent_s: float) -> None:
        log.error("child.silent", child="bench", child_pid=bench.pid, silent_s=round(silent_s, 1))
        bench.signal(signal.SIGKILL)

    # -- watching

    def _watch_on(self, web: WebKeeper) -> None:
        try:
            self._watch()
            web.check()
        except LabctlError as error:
            log.critical("process.gives_up", reason=str(error))
            raise

    def _watch(self) -> None:
        notified, since, beaten = Elapsed(), Elapsed(), Elapsed()
        while not self._waker.ending:
            since.restart()
            self._waker.wait(POLL_INTERVAL_S)
            if since.s > POLL_INTERVAL_S + LATE_S and self._bench is not None:
                self._bench.excuse()
            self._look_after_bench()
            if self._bench is not None and beaten.s > BEAT_S:
                beaten.restart()
                self._bench.tell("beat")
            if notified.s > systemd.period_s():
                notified.restart()
                systemd.alive()

    def _look_after_bench(self) -> None:
        bench = self._bench
        assert bench is not None
        if (silent_s := bench.heard_s) > SILENT_S:
            self._kill_bench(bench, silent_s)
        if not bench.wait(0.0) or self._waker.ending:
            return
        log.error("child.ended", child="bench", child_pid=bench.pid)
        bench.close()
        self._secured()
        self._restarts.one_more("the bench process")
        self._bench = bench = self._start_bench()
        log.warning("child.restarted", child="bench", child_pid=bench.pid)
        bench.tell("begin")

    def _end(self, web: WebKeeper) -> BenchLeft:
        """End both processes, the bench safe first; returns how the bench was left."""
        log.info("process.ending", stopped=self._waker.ending)
        try:
            assert self._bench is not None
            return self._end_bench(self._bench, web)
        finally:
            web.close()
            self._end_guarding()

    def _web_settings(self) -> WebSettings:
        return WebSettings(self._request, self._folder, self._at.socket.fileno(), self._at.name, self._ahead)
