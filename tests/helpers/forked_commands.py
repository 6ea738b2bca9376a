"""`labctl` run to its end in processes forked from a loaded one; see `tests.helpers.command_server`."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from tests.helpers import command_client
from tests.helpers.paths import ROOT
from tests.helpers.signal_defaults import default_signals


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


def shell_command() -> str:
    """Return the text of a program for a shell: `labctl`, run by this process's command server."""
    client = f"{sys.executable} -I -S {command_client.__file__} {server_address()}"
    return f'#!/bin/sh\nexec {client} "$@"\n'
