"""Runs `labctl` in processes of its own that are forked from one that has loaded it.

Each of them is a process as any other: with its own arguments, folder, environment, files and end. What it is spared is
a second of processor time to load the libraries, and a service three. Tests of the start itself, and of signals to a
command, start `python -m labctl`.
"""

from __future__ import annotations

import gc
import importlib
import json
import os
import resource
import select
import signal
import socket
import sys
import threading
from collections.abc import Callable
from typing import Any, TextIO, cast

from tests.helpers import spare_processes
from tests.helpers.built_command import build_once, built
from tests.helpers.paths import ROOT

#: What commands of labctl load when they are called.
MODULES = (
    "blosc2", "pyarrow.csv", "pyarrow.parquet", "alembic.command", "labctl.cli.app", "labctl.cli.printing.criticism",
    "labctl.plots", "labctl.processes.bench_process", "labctl.processes.supervisor", "labctl.processes.web_process",
    "labctl.services.commands.computed", "labctl.services.commands.open",
    "labctl.services.commands.registry", "labctl.services.criticism.evaluation",
    "labctl.services.criticism.next_experiment", "labctl.services.criticism.planned_visibility",
    "labctl.services.lab_service",
)  # fmt: skip

#: Exit status of a process whose output could not be written at its end, as Python's own.
UNREAD = 120


def serve(address: str) -> None:
    """Fork a process for each request until standard input ends; returns in the forked processes only."""
    for module in MODULES:
        importlib.import_module(module)
    build_once()
    built(importlib.import_module("labctl.cli.app").app)
    gc.freeze()  # pages that the collector does not touch stay shared
    woken, waking = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    signal.set_wakeup_fd(waking)
    signal.signal(signal.SIGCHLD, lambda *_: None)
    running: dict[int, socket.socket] = {}
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(address)
        listener.listen()
        os.write(1, b"ready\n")
        while True:
            ready, _, _ = select.select([listener, woken, 0, *running.values()], [], [])
            if 0 in ready:
                sys.exit()
            if woken in ready:
                os.read(woken, 4096)
                _report(running)
            for pid in [pid for pid, line in running.items() if line in ready]:
                os.kill(pid, signal.SIGKILL)  # who asked is gone
                running.pop(pid).close()
            if listener in ready and _forks(listener.accept()[0], running):
                return


def _report(running: dict[int, socket.socket]) -> None:
    """Tell those who asked how their processes ended."""
    while True:
        try:
            pid, status = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if pid == 0:
            return
        if line := running.pop(pid, None):
            with line:
                line.sendall(b"%d\n" % os.waitstatus_to_exitcode(status))


def _forks(line: socket.socket, running: dict[int, socket.socket]) -> bool:
    """Fork the process of a request; returns whether this is it."""
    _, streams, _, _ = socket.recv_fds(line, 1, 3)
    request = json.loads(line.makefile().readline())
    pid = os.fork()
    if pid == 0:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        for other in [line, *running.values()]:
            other.close()
        _become(request, streams)
        return True
    line.sendall(b"%d\n" % pid)
    running[pid] = line
    for stream in streams:
        os.close(stream)
    return False


def _become(request: dict[str, Any], streams: list[int]) -> None:
    """Take over arguments, folder, environment and files of a request."""
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)
    sys.stdin, sys.stdout, sys.stderr = _opened(0, "r"), _opened(1, "w"), _opened(2, "w")
    os.chdir(request["folder"])
    inherited = {str(ROOT), *os.environ.get("PYTHONPATH", "").split(os.pathsep)}
    os.environ.clear()
    os.environ.update(request["environment"])
    if open_files := request["open_files"]:
        resource.setrlimit(resource.RLIMIT_NOFILE, (open_files, open_files))
    own = [place for place in os.environ.get("PYTHONPATH", "").split(os.pathsep) if place]
    sys.path[:] = [request["folder"], *own, *(place for place in sys.path if place not in inherited)]
    importlib.invalidate_caches()
    sys.argv = ["labctl", *request["arguments"]]


def status_of(program: Callable[[], None]) -> int:
    """Run a program to its end, as Python runs that of a process; returns its exit status.

    The memory is not taken apart afterwards: it is that of all commands, and each page that is written to is copied.
    """
    status = 0
    try:
        program()
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        if isinstance(ended.code, str):
            sys.stderr.write(f"{ended.code}\n")
    except BaseException as error:  # noqa: BLE001  as Python reports what nothing else has
        sys.excepthook(type(error), error, error.__traceback__)
        status = 1
    for thread in threading.enumerate():
        if thread is not threading.current_thread() and not thread.daemon:
            thread.join()
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # the reader has gone
        status = status or UNREAD
    return status


def _opened(number: int, mode: str) -> TextIO:
    return cast(TextIO, open(number, mode, buffering=1, encoding="utf-8", closefd=False))


if __name__ == "__main__":
    serve(sys.argv[1])
    if sys.argv[1:2] == ["serve"]:
        spare_processes.provide()
    from labctl.cli import main
    from labctl.processes.children import leave

    leave(status_of(main))
