"""`labctl` run to its end in processes forked from a loaded one; see `tests.helpers.command_server`."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO, Any

from tests.helpers import command_client
from tests.helpers.paths import ROOT
from tests.helpers.signal_defaults import default_signals
from tests.helpers.started_elsewhere import arguments_of_start, close_pipes


@cache
def server_address() -> str:
    """Return the socket of this process's command server, which is started by the first who asks."""
    folder = tempfile.TemporaryDirectory()
    address = f"{folder.name}/socket"
    found = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    with default_signals():
        server = subprocess.Popen(
            [sys.executable, "-m", "tests.helpers.command_server", address],
            cwd=ROOT, env={**os.environ, "PYTHONPATH": os.pathsep.join(found)}, start_new_session=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
    assert server.stdout is not None
    assert server.stdout.readline() == b"ready\n"

    def end() -> None:
        server.communicate()
        folder.cleanup()

    atexit.register(end)
    return address


def run_labctl(
    arguments: Sequence[str], *, folder: Path | None = None, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end; returns its status and what it wrote."""
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err, Path(os.devnull).open() as nothing:
        streams = [nothing.fileno(), out.fileno(), err.fileno()]
        where = str(folder or Path.cwd())
        status = command_client.ask(server_address(), arguments, where, environment or os.environ, streams)
        out.seek(0), err.seek(0)
        return subprocess.CompletedProcess(["labctl", *arguments], status, out.read(), err.read())


class ForkedCommand(subprocess.Popen[str]):
    """A process of `labctl`, with pipes for what it writes, that is forked from a loaded one.

    It is as any other of `subprocess`, except that its end is reported by the process it was forked from.
    """

    def __init__(
        self,
        arguments: Sequence[str],
        *,
        stderr: int | IO[bytes] | None = subprocess.PIPE,
        folder: Path | None = None,
        environment: Mapping[str, str] | None = None,
        open_files: int | None = None,
    ) -> None:
        """Begin it; `open_files` is all that it may open."""
        self._open_files = open_files
        super().__init__(
            ["labctl", *arguments], stdout=subprocess.PIPE, stderr=stderr, text=True, cwd=folder, env=environment
        )

    def _execute_child(self, *given: Any) -> None:
        """Begin the process, as `subprocess` would."""
        named = arguments_of_start(self, *given)
        error = named["errwrite"]
        with Path(os.devnull).open() as nothing:
            self.pid, self._line = command_client.begin(
                server_address(), named["args"][1:], str(named["cwd"] or Path.cwd()), named["env"] or os.environ,
                [nothing.fileno(), named["c2pwrite"], 2 if error == -1 else error], self._open_files,
            )  # fmt: skip
        self._child_created = True
        close_pipes(self, named)

    def _try_wait(self, wait_flags: int) -> tuple[int, int]:
        """Return the process and its wait status once it is over, 0 before."""
        if not wait([self._line], 0 if wait_flags & os.WNOHANG else None):
            return 0, 0
        with self._line:
            status = command_client.read(self._line)
        return self.pid, status << 8 if status >= 0 else -status

    def _internal_poll(self, *_: object, **__: object) -> int | None:
        """Return the exit status, None while it runs."""
        if self.returncode is None:
            pid, status = self._try_wait(os.WNOHANG)
            if pid:
                self.returncode = os.waitstatus_to_exitcode(status)
        return self.returncode


def shell_command() -> str:
    """Return the text of a program for a shell: `labctl`, run by this process's command server."""
    client = f"{sys.executable} -I -S {command_client.__file__} {server_address()}"
    return f'#!/bin/sh\nexec {client} "$@"\n'
