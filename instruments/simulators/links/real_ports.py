"""Real pseudo-terminals and TCP ports on this machine, each carried by a thread to a callable."""

from __future__ import annotations

import os
import socket
import threading
import tty
from collections.abc import Callable
from typing import Any

from instruments.clock import Clock, SystemClock, heartbeat_interval_s, registered

#: Bytes from the host -> bytes of the instrument; called with b"" when the host sent nothing.
Exchange = Callable[[bytes], bytes]

LOCALHOST = "127.0.0.1"
ACCEPT_TIMEOUT_S = 0.2
JOIN_TIMEOUT_S = 2.0
BLOCK_BYTES = 4096  #: of one read; a terminal that is not read keeps this many last bytes


class RealPorts:
    """Open ports and their threads, for which `clock` waits where it is one that waits."""

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or SystemClock()
        self._every_s = heartbeat_interval_s(self._clock)
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []
        self._open: list[Any] = []

    def open_terminal(self, exchange: Exchange) -> str:
        """Open a pseudo-terminal; returns the path that a host opens. Raises OSError."""
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)
        self._open.append(os.fdopen(theirs, "rb", buffering=0))
        self._open.append(os.fdopen(os.dup(ours), "rb", buffering=0))
        self._run(self._carry_terminal, ours, exchange)
        return os.ttyname(theirs)

    def open_byte_server(self, exchange_of_link: Callable[[], Exchange]) -> int:
        """Listen for connections that carry the instrument's bytes; returns the TCP port. Raises OSError.

        `exchange_of_link` is called once for each connection.
        """

        def carry(connection: socket.socket) -> None:
            self._carry_connection(connection, exchange_of_link())

        return self._listen(carry)

    def open_line_server(self, answer: Callable[[str], str]) -> int:
        """Listen for connections with one request per line; returns the TCP port. Raises OSError."""

        def carry(connection: socket.socket) -> None:
            with connection, connection.makefile("rw") as lines:
                for line in lines:
                    lines.write(f"{answer(line)}\n")
                    lines.flush()

        return self._listen(carry)

    def wait(self) -> None:
        """Return when `close` is called."""
        self._closing.wait()

    def close(self) -> None:
        """Close every port and end every thread; safe to call twice."""
        self._closing.set()
        for thread in self._threads:
            thread.join(timeout=JOIN_TIMEOUT_S)
        for opened in self._open:
            opened.close()

    def _run(self, work: Callable[..., None], *arguments: Any) -> None:
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _listen(self, carry: Callable[[socket.socket], None]) -> int:
        listener = socket.create_server((LOCALHOST, 0))
        listener.settimeout(ACCEPT_TIMEOUT_S)
        self._open.append(listener)
        self._run(self._accept, listener, carry)
        return int(listener.getsockname()[1])

    def _accept(self, listener: socket.socket, carry: Callable[[socket.socket], None]) -> None:
        while not self._closing.is_set():
            try:
                connection, _ = listener.accept()
            except TimeoutError:
                continue
            except OSError:
                return
            self._run(carry, connection)

    def _carry_terminal(self, ours: int, exchange: Exchange) -> None:
        waiting = b""
        with registered(self._clock) as heartbeat:
            while not self._closing.wait(self._every_s):
                try:
                    received = os.read(ours, BLOCK_BYTES)
                except BlockingIOError:
                    received = b""
                waiting += exchange(received)
                try:
                    waiting = waiting[os.write(ours, waiting) :] if waiting else b""
                except BlockingIOError:
                    waiting = waiting[-BLOCK_BYTES:]  # the terminal is full: a port keeps its last bytes
                heartbeat()
        os.close(ours)

    def _carry_connection(self, connection: socket.socket, exchange: Exchange) -> None:
        connection.settimeout(self._every_s)
        with connection, registered(self._clock) as heartbeat:
            while not self._closing.is_set():
                heartbeat()
                try:
                    received = connection.recv(BLOCK_BYTES)
                except TimeoutError:
                    continue
                except OSError:
                    return
                if not received:
                    return
                connection.sendall(exchange(received))
