"""The web process: HTTP, pages, imports, fits and criticism. It reads the database; the bench process writes."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import socket
import threading
from collections.abc import Iterator
from multiprocessing.connection import Connection

import uvicorn

from instruments.clock import WallClock
from labctl import web
from labctl.api.access_policy import MIB, AccessPolicy, ReadOnlyAccess
from labctl.api.app import create_app
from labctl.api.connection_limits import limits_for, raise_open_files
from labctl.api.http_protocol import bounded_http
from labctl.config import os_user
from labctl.log import get_logger
from labctl.processes.children import begin_child_log, end_with_parent, leave, line_to_parent, tell, tell_refusal
from labctl.processes.remote_bench import RemoteBench, RemoteWriter
from labctl.processes.settings import KEYS, LOOPBACK_NAMES, ServeRequest, WebSettings, is_loopback
from labctl.processes.supervisor_watch import SupervisorWatch
from labctl.services.admin.api_keys import require_an_api_key
from labctl.services.admin.key_memory import KeyMemory
from labctl.services.computation import InWorkers
from labctl.services.lab_service import VERSION, LabService
from labctl.services.planning.loading import load_bench
from labctl.stop.client import not_stopped_text, stop_bench
from labctl.stop.latch import StopRequest
from labctl.stop.page import write_keys
from labctl.stop.places import place_of
from labctl.stop.priority import of_the_pages
from labctl.store import Store
from labctl.store.connection.database import Database

log = get_logger()

#: Time that requests have to end before they are closed, s.
GRACE_S = 2
BEAT_S = 1
#: Modules of the workers, loaded once for all of them.
WORKER_MODULES = (
    "blosc2", "pyarrow.csv", "pyarrow.parquet", "labctl.plots", "labctl.processes.remote_bench",
    "labctl.services.commands.computed", "labctl.services.commands.registry",
    "labctl.services.criticism.next_experiment", "labctl.services.criticism.evaluation", "labctl.services.lab_service",
    "labctl.services.criticism.planned_visibility", "labctl.store.repositories.recordings",
)  # fmt: skip


def create_service(settings: WebSettings) -> LabService:
    """Open the store for reading and, unless the service only reads, the bench process for writing.

    Raises BadBench, StoreError.
    """
    request, folder = settings.request, settings.folder
    if request.read_only:
        reading = Store(Database(request.location, write=False, read_only=True))
        return LabService(
            reading, WallClock(), computation=InWorkers(reading, preload=WORKER_MODULES), acts_at=request.acts_at
        )
    bench = load_bench(request.bench_name) if request.bench_name is not None else None
    store = Store(Database(request.location, write=False, writer=RemoteWriter(folder)))
    store.imports.discard_unfinished()  # of a web process that was killed
    computation = InWorkers(store, preload=WORKER_MODULES)
    return LabService(
        store, WallClock(settings.ahead), computation=computation, access=RemoteBench(folder, bench, request.location)
    )


def access_for(request: ServeRequest, store: Store, at: str) -> AccessPolicy:
    """Return who is admitted: on loopback this machine's users, elsewhere callers with a key. Raises BadInput."""
    upload, read_only = request.max_upload_mib * MIB, ReadOnlyAccess(request.acts_at) if request.read_only else None
    if not request.asks_for_keys:
        return AccessPolicy(hosts=LOOPBACK_NAMES | {at.lower()}, upload_bytes=upload, read_only=read_only)
    policy = (
        "--require-keys"
        if is_loopback(request.host)
        else f"--host {request.host}: this address can be reached from other computers"
    )
    require_an_api_key(store, policy)
    return AccessPolicy(keys=True, upload_bytes=upload, read_only=read_only)


def _end_with(line: Connection) -> None:
    """End this process when its supervisor has ended, so that its address is free for another one."""
    with contextlib.suppress(EOFError, OSError):
        line.recv_bytes(1)  # the supervisor sends nothing more: the read returns when its end is closed
    os.kill(os.getpid(), signal.SIGTERM)


def _stop_for(settings: WebSettings) -> None:
    """Stop the bench for a supervisor that was asked to end and does not react.

    The bench process does the same where it can; this process also ends a bench process that does not react.
    """
    bench = settings.request.bench_name
    if bench is None:
        return
    stop = StopRequest.of_service_end(os_user())
    place = place_of(settings.request.location, load_bench(bench).name)

    def say(text: str) -> None:
        log.critical("stop.not_stopped", text=text)

    outcome = stop_bench(place, stop, say)
    if not outcome.stands:
        say(not_stopped_text(f"bench {outcome.bench}: {outcome.text}"))


def _keys_of(store: Store, settings: WebSettings) -> KeyMemory:
    """Return the keys in force; a copy of their digests is kept with the sockets for use without the database."""
    memory = KeyMemory(store, lambda digests: write_keys(settings.folder / KEYS, digests))
    memory.start()
    return memory


def serve(line: Connection, settings: WebSettings) -> None:
    """Serve until the supervisor ends it. Raises BadInput without a key where one is needed."""
    service = create_service(settings)
    access = access_for(settings.request, service.store, settings.at)
    keys = _keys_of(service.store, settings) if access.keys else None
    app = create_app(service, access, keys)

    async def beat() -> None:
        tell(line, "beat")

    gc.freeze()  # what is loaded stays: looked through with every collection, it holds up requests for 0.15 s
    limits = limits_for(raise_open_files())
    server = uvicorn.Server(
        uvicorn.Config(
            app, log_config=None, log_level="warning", access_log=False, lifespan="on",
            callback_notify=beat, timeout_notify=BEAT_S, proxy_headers=False,
            http=bounded_http(limits), ws="none", backlog=limits.backlog, timeout_keep_alive=limits.idle_s,
            timeout_graceful_shutdown=GRACE_S,
        )
    )  # fmt: skip
    tell(line, "ready")
    log.info("process.started", version=VERSION, host=settings.at, asks_for_a_key=access.keys)
    threading.Thread(target=_end_with, args=(line,), name="supervisor", daemon=True).start()
    threading.Thread(target=web.prepare, name="pages", daemon=True).start()
    SupervisorWatch(os.getppid(), lambda: _stop_for(settings)).start()
    with socket.socket(fileno=settings.listener) as listener, until_sigterm():
        server.run(sockets=[listener])
    if keys is not None:
        keys.close()
    service.close()
    log.info("process.ended")


@contextlib.contextmanager
def until_sigterm() -> Iterator[None]:
    """End the block at the first SIGTERM, which the server raises again at its end.

    Later ones are ignored: the supervisor asks twice, and what ends this process is not interrupted.
    """
    with contextlib.suppress(KeyboardInterrupt):
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        try:
            yield
        finally:
            signal.signal(signal.SIGTERM, signal.SIG_IGN)


def main() -> int:
    """Run the process that the supervisor has started; returns its exit status."""
    end_with_parent()
    of_the_pages()
    line, settings = line_to_parent(WebSettings)
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # the supervisor hears it
    begin_child_log("web", settings.request.location)
    try:
        serve(line, settings)
    except Exception as error:
        log.debug("process.refused", exc_info=error)
        tell_refusal(line, error)
        return 2
    return 0


if __name__ == "__main__":
    leave(main())
