"""The service process: one database, one bench, one HTTP server."""

from __future__ import annotations

import contextlib
import ipaddress
import signal
import socket
from collections.abc import Callable
from dataclasses import dataclass

import uvicorn

from instruments.clock import Clock, WallClock
from labctl.api import systemd
from labctl.api.access_policy import LOOPBACK_NAMES, MIB, AccessPolicy
from labctl.api.app import create_app
from labctl.config import default_database
from labctl.errors import BadInput
from labctl.services.admin.api_keys import require_an_api_key
from labctl.services.benches.lease import hold_bench
from labctl.services.campaigns.bench_runner import BenchRunner
from labctl.services.campaigns.preparation import clock_for
from labctl.services.computation import InWorkers
from labctl.services.lab_service import LabService
from labctl.services.planning.loading import load_bench
from labctl.store import Store
from labctl.store.connection.database import Database
from procedures.execution.signals import signal_handlers

SIMULATED_BENCH = "triaxial-sim"
LAST_PORT = 65535
#: What a worker needs, loaded once for all of them.
WORKER_MODULES = (
    "blosc2", "pyarrow.csv", "pyarrow.parquet", "labctl.plots", "labctl.services.commands.computed",
    "labctl.services.commands.registry", "labctl.services.criticism.next_experiment",
    "labctl.services.criticism.evaluation", "labctl.services.lab_service", "labctl.services.simulation.visibility",
)  # fmt: skip


@dataclass(frozen=True)
class ServeRequest:
    """What to serve, and where."""

    bench: str | None = None
    simulate: bool = False
    speed: float = 1.0  #: of a simulated bench; 0: as fast as it can
    host: str = "127.0.0.1"
    port: int = 8420
    database: str | None = None
    require_keys: bool = False
    max_upload_mib: int = 2048


def create_service(request: ServeRequest, url: str | None) -> LabService:
    """Open the store for this process and put a bench runner beside it, where a bench is named."""
    store = Store(Database(request.database or default_database(), write=True, url=url))
    try:
        name = request.bench or (SIMULATED_BENCH if request.simulate else None)
        runner = None
        if name is not None:
            bench = load_bench(name)
            if request.simulate and not bench.is_simulated:
                raise BadInput(
                    f"--simulate with --bench {name}: that bench has real instruments, and they would move; leave "
                    "--simulate out, or name a bench of sim:// addresses"
                )

            def make_clock() -> Clock:
                own_pace = request.speed == 0 or not bench.is_simulated
                return clock_for(bench, None if own_pace else request.speed)

            runner = BenchRunner(store, bench, make_clock, hold_bench(store, bench))
        return LabService(store, WallClock(), runner, InWorkers(store, preload=WORKER_MODULES))
    except BaseException:
        store.close()
        raise


def serve_forever(request: ServeRequest, ready: Callable[[str], None]) -> str:
    """Serve until interrupted; returns how the bench was left, nothing where there is none.

    Raises BadInput for an address that others can reach while there is no key to ask them for, Conflict, BadBench.
    """
    if not 0 <= request.speed < float("inf"):
        raise BadInput(f"--speed {request.speed}: a positive number, or 0 for as fast as it can")
    if not 0 <= request.port <= LAST_PORT:
        raise BadInput(f"--port {request.port}: 1 to {LAST_PORT}, or 0 for a free one")
    if not 1 <= request.max_upload_mib <= 1 << 20:
        raise BadInput(f"--max-upload-mib {request.max_upload_mib}: 1 to {1 << 20}")
    with socket.socket(socket.AF_INET6 if ":" in request.host else socket.AF_INET) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((request.host, request.port))
        except socket.gaierror as error:
            raise BadInput(f"--host {request.host}: {error.strerror}; name an address of this machine") from error
        except OSError as error:
            raise BadInput(f"--port {request.port} on {request.host}: {error.strerror}; name another, or 0") from error
        at = f"[{request.host}]" if ":" in request.host else request.host
        url = f"http://{at}:{listener.getsockname()[1]}"
        service = create_service(request, url)
        try:
            app = create_app(service, access_for(request, service, at))
        except BaseException:
            service.close()
            raise
        settings = uvicorn.Config(
            app, log_level="warning", lifespan="on", callback_notify=systemd.alive, timeout_notify=systemd.period_s(),
            proxy_headers=False,
        )  # fmt: skip
        server = uvicorn.Server(settings)
        listener.listen(server.config.backlog)  # whoever reads the address may connect at once
        ready(url)
        lost_terminal = {signal.SIGHUP: lambda *_: setattr(server, "should_exit", True)}
        with signal_handlers(lost_terminal):
            try:
                with contextlib.suppress(KeyboardInterrupt):  # Ctrl-C is how it is stopped
                    server.run(sockets=[listener])
            finally:
                service.close()  # a second Ctrl-C makes the server skip it
        return service.left


def access_for(request: ServeRequest, service: LabService, at: str) -> AccessPolicy:
    """Return who may come in: on loopback this machine's users, elsewhere whoever shows a key. Raises BadInput."""
    upload = request.max_upload_mib * MIB
    if _is_loopback(request.host) and not request.require_keys:
        return AccessPolicy(hosts=LOOPBACK_NAMES | {at.lower()}, upload_bytes=upload)
    asked = (
        "--require-keys" if _is_loopback(request.host) else f"--host {request.host}: other machines could reach this"
    )
    require_an_api_key(service.store, asked)
    return AccessPolicy(keys=True, upload_bytes=upload)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
