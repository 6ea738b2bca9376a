"""The socket that listens for HTTP; the supervisor keeps it, so that callers wait while a web process starts anew."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from labctl.errors import BadInput

BACKLOG = 2048


@dataclass(frozen=True)
class Listening:
    """A listening socket and its address."""

    socket: socket.socket
    name: str  #: of the host, as a Host header has it
    url: str


@contextmanager
def listening(host: str, port: int) -> Iterator[Listening]:
    """Listen at an address while the block runs; port 0 takes a free one. Raises BadInput."""
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, port))
        except socket.gaierror as error:
            raise BadInput(f"--host {host}: {error.strerror}; name an address of this machine") from error
        except OSError as error:
            raise BadInput(
                f"--port {port} on {host}: {error.strerror}; give another port, or 0 for a free port"
            ) from error
        name = f"[{host}]" if ":" in host else host
        listener.listen(BACKLOG)  # a client that reads the address may connect at once
        yield Listening(listener, name, f"http://{name}:{listener.getsockname()[1]}")
