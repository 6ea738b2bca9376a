"""The socket that listens for HTTP; the supervisor keeps it, so that callers wait while a web process starts anew."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from errno import EADDRINUSE

from labctl.errors import BadInput

BACKLOG = 2048


@dataclass(frozen=True)
class Listening:
    """A listening socket and its address."""

    socket: socket.socket
    name: str  #: of the host, as a Host header has it
    url: str

    @property
    def port(self) -> int:
        """The TCP port."""
        return int(self.socket.getsockname()[1])


@contextmanager
def listening(
    host: str, port: int, ask_for_it: Callable[[], None] = lambda: None, *, shared: bool = False
) -> Iterator[Listening]:
    """Listen at an address while the block runs; port 0 takes a free one. Raises BadInput.

    `ask_for_it` asks the process that answers there, in place of a service that is gone, to give the address back.
    With `shared` further sockets of this user may listen at the same address.
    """
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if shared:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        try:
            _bind(listener, (host, port), ask_for_it)
        except socket.gaierror as error:
            raise BadInput(f"--host {host}: {error.strerror}; name an address of this machine") from error
        except OSError as error:
            raise BadInput(
                f"--port {port} on {host}: {error.strerror}; give another port, or 0 for a free port"
            ) from error
        name = f"[{host}]" if ":" in host else host
        listener.listen(BACKLOG)  # a client that reads the address may connect at once
        yield Listening(listener, name, f"http://{name}:{listener.getsockname()[1]}")


def refuse_taken(host: str, port: int) -> None:
    """Raise BadInput where another service listens at an address: a shared one would be given to both."""
    with listening(host, port):
        pass


def _bind(listener: socket.socket, at: tuple[str, int], ask_for_it: Callable[[], None]) -> None:
    """Bind to an address, once more where it was taken and could be asked for. Raises OSError."""
    try:
        listener.bind(at)
    except OSError as error:
        if error.errno != EADDRINUSE:
            raise
        ask_for_it()
        listener.bind(at)
