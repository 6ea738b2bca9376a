"""Bytes of lines as they arrive: from standard input, or from a TCP server."""

from __future__ import annotations

import os
import select
import socket
from contextlib import suppress
from typing import Protocol

from labctl.errors import BadInput

#: Bytes that one call takes at most: more waits for the next.
MAX_BYTES = 1 << 20
CONNECT_WITHIN_S = 10.0
TCP = "tcp://"


class LineFeed(Protocol):
    """Bytes that arrive without being asked for."""

    name: str
    may_lose: bool  #: whether a line that was sent may not arrive, and the next one does

    def open(self) -> None:
        """Open it; raises BadInput."""
        ...

    def take(self) -> bytes | None:
        """Return what has arrived, without waiting; None at the end of the stream."""
        ...

    def close(self) -> None:
        """Close it; safe to call twice."""
        ...


class DescriptorFeed:
    """An open file descriptor, such as standard input."""

    may_lose = False

    def __init__(self, descriptor: int, name: str) -> None:
        self._descriptor, self.name = descriptor, name

    def open(self) -> None:
        """Nothing is to be opened. Raises BadInput for a terminal, on which a person would have to type readings."""
        if os.isatty(self._descriptor):
            raise BadInput(
                f"--lines -: {self.name} is a terminal; pipe the readings in, such as "
                "`ros2 topic echo --csv /imu/data | labctl live IMU-1 --lines -`, or name tcp://HOST:PORT"
            )

    def take(self) -> bytes | None:
        received = b""
        while len(received) < MAX_BYTES and select.select([self._descriptor], [], [], 0)[0]:
            data = os.read(self._descriptor, 1 << 16)
            if not data:
                return received or None
            received += data
        return received

    def close(self) -> None:
        """Leave it open: the process has it from its parent."""


class SocketFeed:
    """Part of the feeds that read a socket: its name and its end."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._socket: socket.socket | None = None

    def close(self) -> None:
        """Close the socket; safe to call twice."""
        if self._socket is not None:
            with suppress(OSError):
                self._socket.close()
            self._socket = None


class TcpFeed(SocketFeed):
    """A server that sends lines to every client."""

    may_lose = False

    def __init__(self, address: str) -> None:
        """Take tcp://HOST:PORT; raises BadInput for another form."""
        host, _, port = address.removeprefix(TCP).rpartition(":")
        if not address.startswith(TCP) or not host or not port.isdecimal() or not 0 < int(port) < 65536:
            raise BadInput(
                f"{address}: no address of a stream; give tcp:// or udp://HOST:PORT, ws://HOST:PORT of a rosbridge "
                "server, or, at the terminal, - for standard input"
            )
        super().__init__(address)
        self._place = host.strip("[]"), int(port)

    def open(self) -> None:
        try:
            self._socket = socket.create_connection(self._place, CONNECT_WITHIN_S)
        except OSError as error:
            raise BadInput(
                f"{self.name}: cannot connect ({error}); check address, and that the sender listens there"
            ) from error
        self._socket.setblocking(False)

    def take(self) -> bytes | None:
        received = b""
        while self._socket is not None and len(received) < MAX_BYTES:
            try:
                data = self._socket.recv(1 << 16)
            except BlockingIOError:
                return received
            except OSError:  # reset by the sender: what it sent before is kept
                data = b""
            if not data:
                return received or None
            received += data
        return received
