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
    request = {"arguments": list(arguments), "folder": folder, "environment": dict(environment)}
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(address)
        socket.send_fds(line, [b"\n"], list(streams))
        line.sendall(json.dumps(request).encode() + b"\n")
        answer = line.makefile().readline()
    if not answer:
        raise ConnectionError("the command server ended")
    return int(answer)


if __name__ == "__main__":
    ended = ask(sys.argv[1], sys.argv[2:], os.getcwd(), os.environ, (0, 1, 2))  # noqa: PTH109 (pathlib takes 10 ms)
    sys.exit(ended if ended >= 0 else 128 - ended)
