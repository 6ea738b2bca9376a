"""`labctl serve` without its web process, forked from a process that has loaded it: a start costs a tenth of a second.

Supervisor and bench process are labctl's own, with their own signals, sockets and files; only how they come into being
differs. In the place of the web process the supervisor answers stops at the service's address.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from logging import INFO
from multiprocessing import forkserver, process
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from labctl.log.setup import running_log
from labctl.processes import supervisor
from labctl.processes.children import Child, leave
from labctl.processes.held_address import HeldAddress
from labctl.processes.listening import Listening
from labctl.processes.settings import ServeRequest, WebSettings, page_access
from labctl.stop.latch import StopRequest
from labctl.stop.page import BenchNow
from labctl.stop.priority import first_of_all
from labctl.stop.wire import Stopping

CONTEXT = multiprocessing.get_context("forkserver")
PRELOAD = [
    "labctl.processes.supervisor", "labctl.processes.bench_process", "labctl.stop.instruments_stop",
    "labctl.services.planning.loading", "instruments.drivers.arrick", "studies.forked_service",
]  # fmt: skip
READY_S = 60.0


class Forked:
    """A forked process, with what `Child` uses of a `subprocess.Popen`."""

    def __init__(self, made: Any) -> None:
        self._made = made
        self.pid = int(made.pid)

    @property
    def returncode(self) -> int | None:
        """How it ended: its exit status, negative for a signal; None while it runs."""
        status: int | None = self._made.exitcode
        return status

    def poll(self) -> int | None:
        """Return the same."""
        return self.returncode

    def wait(self, timeout_s: float | None = None) -> None:
        """Wait for its end. Raises TimeoutExpired."""
        self._made.join(timeout_s)
        if self.returncode is None:
            raise subprocess.TimeoutExpired("forked", timeout_s or 0.0)

    def send_signal(self, number: signal.Signals) -> None:
        """Send a signal, unless it is over."""
        if self.returncode is None:
            os.kill(self.pid, number)


class ForkedChild(Child):
    """A child process that was forked."""

    def __init__(self, module: str, pass_fds: Sequence[int] = ()) -> None:
        assert not pass_fds
        ours, theirs = socket.socketpair()
        line = Connection(theirs.detach())
        environment = {"XDG_STATE_HOME": os.environ["XDG_STATE_HOME"]}
        made = CONTEXT.Process(target=_run_child, args=(module, line, environment, os.environ["STUDY_LOG"]))
        made.start()
        # the end of the supervisor does not wait for this child's; there is no public way to say so
        process._children.discard(made)  # type: ignore[attr-defined]  # noqa: SLF001
        line.close()
        self._process = Forked(made)  # type: ignore[assignment]
        self.line = Connection(ours.detach())
        self.name = module.rpartition(".")[2].replace("_", " ")


class PageKeeper:
    """Answers stops at the service's address, as while there is no web process."""

    pid = 0

    def __init__(
        self,
        at: Listening,
        _waker: object,
        settings: Callable[[], WebSettings],
        respond: Callable[[StopRequest], Stopping],
    ) -> None:
        self._at, self._settings = at, settings
        self._address = HeldAddress(respond, lambda: BenchNow("This service has no web process."))

    def open(self) -> None:
        """Nothing."""

    def keep(self) -> None:
        """Answer from now on."""
        settings = self._settings()
        self._address.take(self._at.socket.dup())
        self._address.open_page(page_access(settings.request.asks_for_keys, settings.at, settings.folder))

    def check(self) -> None:
        """Nothing."""

    def end_soon(self) -> None:
        """Nothing."""

    def close(self) -> None:
        """Give the address back."""
        self._address.give_back()


def start(request: ServeRequest, state: Path, log: Path) -> tuple[Any, supervisor.Ready | None]:
    """Start a service; returns its supervisor as a process, and where it answers, None where it did not start."""
    CONTEXT.set_forkserver_preload(PRELOAD)
    ours, theirs = CONTEXT.Pipe()
    forked = CONTEXT.Process(target=_run_supervisor, args=(request, theirs, str(state), str(log)))
    forked.start()
    theirs.close()
    with ours:
        try:
            return forked, ours.recv() if ours.poll(READY_S) else None
        except EOFError:
            return forked, None


def _run_supervisor(request: ServeRequest, ready: Connection, state: str, log: str) -> None:
    _enter({"XDG_STATE_HOME": state, "STUDY_LOG": log}, log)
    # children of this process come from the same server
    forkserver._forkserver.ensure_running = lambda: None  # type: ignore[method-assign]  # noqa: SLF001
    vars(supervisor).update(Child=ForkedChild, WebKeeper=PageKeeper)
    first_of_all()
    status = 0
    try:
        with running_log("supervisor", INFO):
            supervisor.serve_forever(request, ready.send)
    except Exception as error:  # noqa: BLE001  as the command line, which prints it
        sys.stderr.write(f"labctl: {error}\n")
        status = 2
    sys.stderr.flush()
    leave(status)


def _run_child(module: str, line: Connection, environment: dict[str, str], log: str) -> None:
    _enter(environment, log)
    sys.argv = [module, str(line.fileno())]
    leave(importlib.import_module(module).main())


def _enter(environment: dict[str, str], log: str) -> None:
    os.setsid()
    os.environ.update(environment)
    written = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(written, 2)
    os.close(written)
