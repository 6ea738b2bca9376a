"""A network that can be cut: a TCP port that leads to the Unix socket of a PostgreSQL server, or to nothing."""

from __future__ import annotations

import select
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

#: How often an idle connection sees that it was cut, s.
POLL_S = 0.05
PIECE_BYTES = 65536


class Network:
    """Passes connections on. While it is cut, every connection is reset and a new one ends at once."""

    def __init__(self, server: Path) -> None:
        """Lead to the Unix socket `server`."""
        self._server = server
        self._listener = socket.create_server(("127.0.0.1", 0), backlog=64)
        self._is_cut, self._over = threading.Event(), threading.Event()
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()

    @property
    def port(self) -> int:
        """The port that leads to the server."""
        return int(self._listener.getsockname()[1])

    def cut(self) -> None:
        """Cut the network."""
        self._is_cut.set()

    def mend(self) -> None:
        """Let connections through again."""
        self._is_cut.clear()

    def close(self) -> None:
        """End every connection, and the port."""
        self._over.set()
        self._listener.close()
        for thread in self._threads:
            thread.join()

    def _accept(self) -> None:
        while not self._over.is_set():
            with suppress(OSError):
                if not select.select([self._listener], [], [], POLL_S)[0]:
                    continue
                near, _ = self._listener.accept()
                thread = threading.Thread(target=self._pass_on, args=(near,), daemon=True)
                self._threads.append(thread)
                thread.start()

    def _pass_on(self, near: socket.socket) -> None:
        with near, socket.socket(socket.AF_UNIX) as far, suppress(OSError):
            if not self._is_cut.is_set():
                far.connect(str(self._server))
                other = {near: far, far: near}
                while not (self._is_cut.is_set() or self._over.is_set()):
                    for ready in select.select([near, far], [], [], POLL_S)[0]:
                        if not (piece := ready.recv(PIECE_BYTES)):
                            return
                        other[ready].sendall(piece)
            near.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closed by a reset


@contextmanager
def network_to(server: Path) -> Iterator[Network]:
    """Run a network for the block."""
    network = Network(server)
    try:
        yield network
    finally:
        network.close()
