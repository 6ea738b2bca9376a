"""Processes that wait, loaded, for a supervisor that starts its children: those of a start, not those of a restart.

A supervisor that was forked with all modules loaded forks these while it has one thread and nothing open. Each waits
until the supervisor would start `python -m module`, and then is that process: a child of the supervisor, with the
session, the descriptors and the environment that it was to have. A child that is started again is started as ever.
The web process has its fork server in the same way.
"""

from __future__ import annotations

import fcntl
import importlib
import json
import os
import socket
import subprocess
import sys
from collections.abc import Sequence
from multiprocessing import util
from types import ModuleType, SimpleNamespace
from typing import Any, NoReturn

from labctl.processes import children
from tests.helpers.started_elsewhere import arguments_of_start, close_pipes, start

WEB = "labctl.processes.web_process"
#: How many processes `labctl serve` starts.
STARTED = 2
#: Descriptors of a spare process while it takes those that it is given, and how many these are at most.
HIGH, MAX_GIVEN = 128, 16


class Spares:
    """The processes that wait."""

    def __init__(self) -> None:
        self._lines: list[tuple[int, socket.socket]] = []

    def fork(self) -> None:
        """Fork one more; in it, this does not return."""
        ours, theirs = socket.socketpair()
        pid = os.fork()
        if pid == 0:
            for line in (ours, *(line for _, line in self._lines)):
                line.close()
            _become_what_is_asked(theirs)
        theirs.close()
        self._lines.append((pid, ours))

    def run(self, command: Sequence[str | bytes], passed: Sequence[int]) -> int | None:
        """Let one run a command of Python with these descriptors; returns it, None where there is none."""
        if not self._lines:
            return None
        pid, line = self._lines.pop(0)
        words = [os.fsdecode(word) for word in command]
        request = {"command": words, "passed": [*passed], "environment": dict(os.environ)}
        with line:
            socket.send_fds(line, [b"\n"], passed)
            line.sendall(json.dumps(request).encode() + b"\n")
        return pid


class SpareChild(subprocess.Popen[bytes]):
    """A process of `subprocess`, which takes a spare process where there is one."""

    spares = Spares()

    def _execute_child(self, *given: Any) -> None:
        named = arguments_of_start(self, *given)
        pid = self.spares.run(named["args"], named["pass_fds"])
        if pid is None:
            start(self, *given)
            return
        self.pid = pid
        self._child_created = True
        close_pipes(self, named)


def provide() -> None:
    """Have spare processes for the children that this process, a supervisor that has not begun yet, starts."""
    for _ in range(STARTED):
        SpareChild.spares.fork()
    found = {name: getattr(subprocess, name) for name in ("DEVNULL", "TimeoutExpired")}
    setattr(children, "subprocess", SimpleNamespace(Popen=SpareChild, **found))  # noqa: B010  another type


def _provide_fork_server(spares: Spares) -> None:
    """Have a spare process for the fork server of this process, which starts that of its computations."""
    spares.fork()
    spawn = util.spawnv_passfds

    def spawned(path: bytes, words: Sequence[Any], passed: Sequence[int]) -> int:
        pid = spares.run(words, sorted(passed)) if "multiprocessing.forkserver" in words[-1] else None
        return spawn(path, words, passed) if pid is None else pid

    util.spawnv_passfds = spawned


def _become_what_is_asked(line: socket.socket) -> None:
    """Wait for what to run, and run it; end with the process that forked this one."""
    received, descriptors, _, _ = socket.recv_fds(line, 1, MAX_GIVEN)
    if not received:
        os._exit(0)
    request = json.loads(line.makefile().readline())
    line.close()
    _take(descriptors, request["passed"])
    os.environ.clear()
    os.environ.update(request["environment"])
    if request["command"][-2] == "-c":
        _be_fork_server(request["command"][-1])
    _be_child(*request["command"][-2:])


def _be_child(module: str, argument: str) -> NoReturn:
    """Run a process of a service."""
    os.setsid()
    for stream in (0, 1):
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, stream)
        os.close(null)
    sys.argv = [module, argument]
    sys.modules["__main__"] = found = importlib.import_module(module)
    if module == WEB:
        _provide_fork_server(Spares())
    children.leave(found.main())


def _be_fork_server(program: str) -> NoReturn:
    """Run the process that the computations of a service are forked from."""
    del sys.modules[WEB]  # which a worker runs as its main module
    sys.argv = ["-c"]
    sys.modules["__main__"] = main = ModuleType("__main__")
    exec(program, vars(main))  # as of `python -c`
    sys.exit()


def _take(received: Sequence[int], wanted: Sequence[int]) -> None:
    """Give descriptors the numbers that they have in the process which sent them."""
    high = [fcntl.fcntl(each, fcntl.F_DUPFD_CLOEXEC, HIGH) for each in received]
    for each in received:
        os.close(each)
    for each, number in zip(high, wanted, strict=True):
        os.dup2(each, number)
        os.close(each)
