"""The bench process: engine, instruments, journal, schedule, and the one writing connection of the database.

It computes no fit but that of a live calibration, while no campaign runs. Other processes call it over Unix sockets; a
stop has a socket and a thread of its own that wait for no lock and no database. It outlives its supervisor: a campaign
goes on or ends by the rule of its recipe, a page at the service's address can stop it, and another supervisor finds it
again.
"""

from __future__ import annotations

import contextlib
import sys
import threading
from importlib.metadata import version
from logging import ERROR, INFO
from multiprocessing.connection import Connection

from instruments.clock import Clock, WallClock
from labctl.errors import BadInput, LabctlError
from labctl.log import get_logger
from labctl.processes.bench_methods import method_of
from labctl.processes.bench_rpc import BenchRpc
from labctl.processes.children import begin_child_log, leave, line_to_parent, tell, tell_refusal
from labctl.processes.driver_note import DriverNoteWriter
from labctl.processes.held_address import HeldAddress
from labctl.processes.liveness import EngineWatch
from labctl.processes.rpc import RpcServer
from labctl.processes.settings import CALLS, STOP, BenchSettings
from labctl.processes.supervision import Supervision
from labctl.processes.supervisor_watch import unheard_end
from labctl.processes.waker import Waker
from labctl.services.benches.bench_left import BenchLeft
from labctl.services.benches.lease import hold_bench
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import clock_for, on_date
from labctl.services.local_bench import LocalBench
from labctl.services.planning.loading import load_bench
from labctl.stop.priority import of_the_bench
from labctl.stop.wire import StopServer
from labctl.store import ServiceAddress, Store
from labctl.store.connection.database import Database
from procedures.execution.signals import ENDING

log = get_logger()

#: An abort is answered within this, with how far the campaign then is, s.
ANSWER_WITHIN_S = 0.2
#: A bench process without a supervisor ends by itself when no campaign has run for so long, s.
ALONE_S = 60.0
POLL_INTERVAL_S = 0.5
SWITCH_S = 0.0005


def open_bench_service(settings: BenchSettings) -> tuple[Store, LocalBench]:
    """Open the database for writing, and the bench where one is named.

    Raises Conflict naming who holds either, BadBench, BadInput for `--simulate` with real instruments.
    """
    address = ServiceAddress(settings.url, str(settings.folder))
    store = Store(Database(settings.location, write=True, address=address))
    try:
        store.imports.discard_unfinished()
        calendar = WallClock(settings.ahead)
        return store, LocalBench(store, calendar, _runner(settings, store, calendar))
    except BaseException:
        store.close()
        raise


def _runner(settings: BenchSettings, store: Store, calendar: Clock) -> BenchRunner | None:
    if settings.bench is None:
        return None
    bench = on_date(load_bench(settings.bench), settings.simulated_start)
    if settings.simulate and not bench.is_simulated:
        raise BadInput(
            f"--simulate with --bench {settings.bench}: that bench has real instruments, which would move; leave "
            "--simulate out"
            ", or name a bench of sim:// addresses"
        )

    def make_clock() -> Clock:
        own_pace = settings.speed == 0 or not bench.is_simulated
        start = None if settings.simulated_start is None else calendar.utc()
        return clock_for(bench, None if own_pace else settings.speed, start)

    make_clock()  # a date that this bench cannot have is refused now
    return BenchRunner(
        store, bench, make_clock, hold_bench(store, bench), safe_within_s=ANSWER_WITHIN_S, wire_logs=settings.wire_logs
    )


class BenchProcess:
    """One run of the process, from the open database to the bench left safe."""

    def __init__(self, settings: BenchSettings, store: Store, local: LocalBench) -> None:
        self._store, self._local = store, local
        self._waker = Waker()
        watch = EngineWatch(lambda: local.polls)
        self._note = DriverNoteWriter(settings, store, local)
        self._address = HeldAddress(local.request_stop, local.describe_running)
        self._supervision = Supervision(
            settings, store, self._waker, watch.is_stuck, self._address, lambda: local.is_at_rest, self._note.write,
            local.end_soon,
        )  # fmt: skip
        if local.scheduler is not None:
            local.scheduler.attended = lambda: self._supervision.alone_s == 0.0
        self._calls = BenchRpc(store, local, self._supervision, self._address, WallClock(settings.ahead))
        self._stop_server = StopServer(settings.folder / STOP, local.request_stop)
        self._call_server = RpcServer(settings.folder / CALLS, self._calls.answer, method_of)

    def run(self, line: Connection) -> None:
        """Serve until asked to end, or left alone; the bench is safe and the database closed when this returns."""
        self._waker.listen_to(ENDING)
        self._note.write(self._supervision.settings)
        self._stop_server.start()
        self._call_server.start()
        tell(line, "ready")
        try:
            self._serve()
        finally:
            self._close()

    def _serve(self) -> None:
        begun = False
        while not self._waker.ending:
            self._waker.wait(POLL_INTERVAL_S)
            if self._supervision.begin and not begun:
                begun = True
                log.info("bench.begun")
                self._local.start()
            self._look_for_supervisor()
            self._hear_for_supervisor()
            if self._supervision.alone_s > ALONE_S and self._local.running is None:
                log.warning("supervisor.gone", alone_s=round(self._supervision.alone_s))
                return

    def _look_for_supervisor(self) -> None:
        """While there is no supervisor, go on or end by the recipe's rule, and answer at the service's address.

        One that stands still guards nothing either, and starts no web process again; while one is there, it answers.
        """
        unguarded = self._supervision.is_unguarded
        if unguarded:
            self._local.note_unsupervised()
        if self._supervision.alone_s > 0.0 or (unguarded and not self._calls.is_watched):
            self._address.open_page(self._supervision.settings.page_access)
        else:
            self._address.close_page()

    def _hear_for_supervisor(self) -> None:
        """End where the supervisor was asked to end and stands still, so that it cannot hear it."""
        pid = self._supervision.settings.guardian_pid
        if self._supervision.alone_s == 0.0 and pid and unheard_end(pid):
            log.error("supervisor.stands_still", supervisor_pid=pid, asked_to_end=True)
            self._waker.end()

    def _close(self) -> None:
        log.info("process.ending", running=self._local.running)
        left = BenchLeft("the state of the bench is not known; inspect the bench", unconfirmed=True)
        try:
            left = self._local.close()
        finally:
            self._call_server.close()
            self._calls.close()  # the callers that are connected; nothing uses the database after them
            with contextlib.suppress(LabctlError):
                self._store.close()
            self._note.write_left(left)
            self._supervision.say_left(left)
            self._stop_server.close()
            self._address.give_back()
            log.log(ERROR if left.unconfirmed else INFO, "process.ended", left=left.text, unconfirmed=left.unconfirmed)


def main() -> int:
    """Run the process that the supervisor has started; returns its exit status."""
    of_the_bench()
    sys.setswitchinterval(SWITCH_S)  # a stop has a thread of its own, which waits for the interpreter only so long
    line, settings = line_to_parent(BenchSettings)
    threading.current_thread().name = "bench"
    begin_child_log("bench", settings.location)
    try:
        store, local = open_bench_service(settings)
    except Exception as error:
        log.debug("process.refused", exc_info=error)
        tell_refusal(line, error)
        return 2
    start = settings.simulated_start
    started = {"version": version("labctl"), "bench": settings.bench, "speed": settings.speed}
    dated = {"simulated_start": None if start is None else start.isoformat()}
    log.info("process.started", **started, **dated, database=store.location)
    BenchProcess(settings, store, local).run(line)
    return 0


if __name__ == "__main__":
    leave(main())
