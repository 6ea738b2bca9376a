"""What `labctl serve --read-only` runs: web processes that answer at one port, and nothing that writes.

There is no bench process, no lease and no guardian. Each web process has a listening socket of its own at the same
address, among which the kernel distributes the connections (socket(7), SO_REUSEPORT). This process holds them all, so
that callers of a process that has ended wait for the one that takes its place.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from labctl.log import get_logger
from labctl.processes import systemd
from labctl.processes.listening import Listening, listening, refuse_taken
from labctl.processes.liveness import Elapsed
from labctl.processes.settings import ServeRequest, WebSettings
from labctl.processes.supervisor import Ready, ending_signals
from labctl.processes.waker import Waker
from labctl.processes.web_keeper import WebKeeper
from labctl.services.campaigns.stop_requests import StopElsewhere
from labctl.services.read_access import acting_service
from labctl.stop.latch import StopRequest
from labctl.stop.wire import Stopping

log = get_logger()

POLL_INTERVAL_S = 0.25


def serve_read_only(request: ServeRequest, ready: Callable[[Ready], None]) -> str:
    """Serve until interrupted; returns an empty text: no bench was driven.

    Raises BadInput as `labctl.processes.supervisor.serve_forever` does, StoreError for a database that is not there.
    """
    request.check()
    with ExitStack() as opened:
        at = _addresses(opened, request)
        waker = opened.enter_context(ending_signals())
        folder = Path(tempfile.mkdtemp(prefix="labctl-"))
        opened.callback(shutil.rmtree, folder, ignore_errors=True)
        keepers = [_keeper(request, each, waker, folder) for each in at]  # all load their modules at the same time
        try:
            _serve(keepers, at[0], waker, ready)
        finally:
            systemd.stopping()
            _end(keepers)
    log.info("process.ended", left="", unconfirmed=False)
    return ""


def _addresses(opened: ExitStack, request: ServeRequest) -> list[Listening]:
    """Return a listening socket for each process, all at one address. Raises BadInput."""
    if request.processes == 1:
        return [opened.enter_context(listening(request.host, request.port))]
    refuse_taken(request.host, request.port)
    at, port = [], request.port
    for _ in range(request.processes):
        at.append(opened.enter_context(listening(request.host, port, shared=True)))
        port = at[0].port
    return at


def _keeper(request: ServeRequest, at: Listening, waker: Waker, folder: Path) -> WebKeeper:
    settings = WebSettings(request, folder, at.socket.fileno(), at.name)
    return WebKeeper(at, waker, lambda: settings, partial(_respond, request))


def _respond(request: ServeRequest, _: StopRequest) -> Stopping:
    """Answer a stop that came over HTTP while no web process answered."""
    return StopElsewhere(
        f"this service is read-only and drives no bench; send the request to {acting_service(request.acts_at)}",
        stands=True,
    )


def _serve(keepers: list[WebKeeper], at: Listening, waker: Waker, ready: Callable[[Ready], None]) -> None:
    for each in keepers:
        each.open()
    pids = tuple(each.pid for each in keepers)
    log.info("process.started", url=at.url, web_pids=pids, read_only=True)
    ready(Ready(at.url, None, pids[0], pids))
    for each in keepers:
        each.keep()
    systemd.ready()
    notified = Elapsed()
    while not waker.ending:
        waker.wait(POLL_INTERVAL_S)
        if notified.s > systemd.period_s():
            notified.restart()
            systemd.alive()
    for each in keepers:
        each.check()


def _end(keepers: list[WebKeeper]) -> None:
    for each in keepers:
        each.end_soon()
    for each in keepers:
        each.close()
