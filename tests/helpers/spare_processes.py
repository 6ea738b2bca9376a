"""Processes that wait, loaded, for a supervisor that starts its children: those of a start, not those of a restart.

A supervisor that was forked with all modules loaded forks these while it has one thread and nothing open. Each waits
until the supervisor would start `python -m module`, and then is that process: a child of the supervisor, with the
session, the descriptors and the environment that it was to have. A child that is started again is started as ever.
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
from types import SimpleNamespace
from typing import Any

from labctl.processes import children
from tests.helpers.started_elsewhere import arguments_of_start, close_pipes, start

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

    def run(self, command: Sequence[str], passed: Sequence[int]) -> int | None:
        """Let one run `python -m module argument` with these descriptors; returns it, None where there is none."""
        if not self._lines:
            return None
        pid, line = self._lines.pop(0)
        request = {"command": [*command], "passed": [*passed], "environment": dict(os.environ)}
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


def _become_what_is_asked(line: socket.socket) -> None:
    """Wait for what to run, and run it; end with the process that forked this one."""
    os.setsid()
    received, descriptors, _, _ = socket.recv_fds(line, 1, MAX_GIVEN)
    if not received:
        os._exit(0)
    request = json.loads(line.makefile().readline())
    line.close()
    _take(descriptors, request["passed"])
    for stream in (0, 1):
        null = os.open(os.devnull, os.O_RDWR)
        os.dup2(null, stream)
        os.close(null)
    os.environ.clear()
    os.environ.update(request["environment"])
    _, _, module, argument = request["command"]
    sys.argv = [module, argument]
    sys.modules["__main__"] = found = importlib.import_module(module)
    children.leave(found.main())


def _take(received: Sequence[int], wanted: Sequence[int]) -> None:
    """Give descriptors the numbers that they have in the process which sent them."""
    high = [fcntl.fcntl(each, fcntl.F_DUPFD_CLOEXEC, HIGH) for each in received]
    for each in received:
        os.close(each)
    for each, number in zip(high, wanted, strict=True):
        os.dup2(each, number)
        os.close(each)
