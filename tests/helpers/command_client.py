"""Asks a command server to run `labctl`; as a program it takes the place of `labctl` in a shell.

It loads nothing but a little of Python's own library: `python -I -S command_client.py SOCKET ARGUMENT...`.
"""

from __future__ import annotations

import json
import os
import socket
import sys
from collections.abc import Mapping, Sequence


def ask(
    address: str, arguments: Sequence[str], folder: str, environment: Mapping[str, str], streams: Sequence[int]
) -> int:
    """Run a command to its end; returns its exit status, -n where signal n ended it.

    `streams` are the open files that are its input, output and error output. A command ends with the process that asked
    for it.
    """
    with begin(address, arguments, folder, environment, streams)[1] as line:
        return read(line)


def begin(
    address: str,
    arguments: Sequence[str],
    folder: str,
    environment: Mapping[str, str],
    streams: Sequence[int],
    open_files: int | None = None,
) -> tuple[int, socket.socket]:
    """Begin a command; returns its process, and the line that its exit status comes on.

    The command ends with that line. `open_files` is all that it may open.
    """
    request = {"arguments": list(arguments), "folder": folder, "environment": dict(environment)}
    line = socket.socket(socket.AF_UNIX)
    line.connect(address)
    socket.send_fds(line, [b"\n"], list(streams))
    line.sendall(json.dumps({**request, "open_files": open_files}).encode() + b"\n")
    return read(line), line


def read(line: socket.socket) -> int:
    """Return the next number from the command server; nothing of what follows is read."""
    answer = b""
    while not answer.endswith(b"\n"):
        if not (piece := line.recv(1)):
            raise ConnectionError("the command server ended")
        answer += piece
    return int(answer)


if __name__ == "__main__":
    ended = ask(sys.argv[1], sys.argv[2:], os.getcwd(), os.environ, (0, 1, 2))  # noqa: PTH109 (pathlib takes 10 ms)
    sys.exit(ended if ended >= 0 else 128 - ended)
