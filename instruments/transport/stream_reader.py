"""Reading a port that receives unsolicited bytes: everything that has come, and when the newest of it came.

A real port is emptied by a thread of its own, so that a slow chamber or a busy processor costs no reading. A simulated
one makes its bytes when it is read: no thread does that, and a seed gives the same campaign again.
"""

from __future__ import annotations

import threading
from typing import NamedTuple, Protocol

from instruments.clock import Clock, heartbeat_interval_s, registered
from instruments.transport.serial import BROKEN, SerialPort, StampingPort

#: A USB adapter holds bytes back for this long, s of real time (latency timer of the FTDI chips, as delivered).
ADAPTER_HOLDS_S = 0.016
#: Bytes that the thread keeps for a reader that does not come; the oldest go first.
KEPT_BYTES = 1 << 22
#: Times of arrival that are kept of these: the older bytes count as arrived with the oldest piece.
KEPT_PIECES = 1 << 16
JOIN_S = 2.0


class Received(NamedTuple):
    """Bytes of a port, and when they came."""

    data: bytes
    now_s: float  #: clock time at which the newest byte was there
    newest_s: float | None = None  #: where that is known better: the newest came within `width_s` before this
    width_s: float | None = None  #: None: since the reading before
    #: Where the bytes arrived in pieces: the number of bytes of each, and when it was there. Empty: all at once.
    pieces: tuple[tuple[int, float], ...] = ()


class StreamReader(Protocol):
    """Empties one open port."""

    def take(self) -> Received:
        """Return everything that has come since the last call, without waiting; raises an error of `BROKEN`."""
        ...

    def discard(self) -> None:
        """Drop everything that was not taken yet; raises an error of `BROKEN`."""
        ...

    def close(self) -> None:
        """End reading; the port stays open. Safe to call twice."""
        ...


def empty(port: SerialPort) -> bytes:
    """Return all bytes that a port holds: one read returns at most the kernel driver's buffer, often 4095 bytes."""
    data = b""
    while (waiting := port.in_waiting) and (part := port.read(waiting)):
        data = data + part if data else part
    return data


class PolledReader:
    """Reads when it is asked."""

    def __init__(self, port: SerialPort, clock: Clock) -> None:
        self._port, self._clock = port, clock
        self._stamps = port if isinstance(port, StampingPort) else None

    def take(self) -> Received:
        """Return everything that has come; raises an error of `BROKEN`."""
        data = empty(self._port)
        if not data:
            return Received(data, self._clock.now_s())
        newest_s = None if self._stamps is None else self._stamps.newest_s
        return Received(data, self._clock.now_s(), newest_s, None if newest_s is None else 0.0)

    def discard(self) -> None:
        """Drop everything that has come; raises an error of `BROKEN`."""
        self._port.reset_input_buffer()

    def close(self) -> None:
        """Do nothing: nothing runs."""


class ThreadedReader:
    """Reads all the time, in a thread of its own, and notes when bytes arrived."""

    def __init__(self, port: SerialPort, clock: Clock) -> None:
        self._port, self._clock = port, clock
        self._lock = threading.Lock()
        self._unread = bytearray()
        self._pieces: list[tuple[int, float]] = []  #: of the unread bytes
        self._came_s = clock.now_s()
        self._broken: Exception | None = None
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="stream reader", daemon=True)
        self._thread.start()

    def take(self) -> Received:
        """Return everything that has come; raises an error of `BROKEN`."""
        with self._lock:
            self._empty()
            if self._broken is not None:
                raise self._broken
            data, came_s, pieces = bytes(self._unread), self._came_s, tuple(self._pieces)
            self._unread.clear()
            self._pieces.clear()
        width_s = ADAPTER_HOLDS_S / self._clock.wall_s(1.0)
        return Received(data, came_s, came_s, width_s, pieces)

    def discard(self) -> None:
        """Drop everything that has come; raises an error of `BROKEN`."""
        with self._lock:
            if self._broken is not None:
                raise self._broken
            self._port.reset_input_buffer()
            self._unread.clear()
            self._pieces.clear()

    def close(self) -> None:
        """End the thread; safe to call twice."""
        self._closing.set()
        self._thread.join(JOIN_S)

    def _run(self) -> None:
        every_s = heartbeat_interval_s(self._clock)
        with registered(self._clock) as heartbeat:
            while not self._closing.wait(every_s):
                with self._lock:
                    if not self._closing.is_set():
                        self._empty()
                    if self._broken is not None:
                        return
                heartbeat()  # here: from one emptying to the next no more comes than a port holds

    def _empty(self) -> None:
        if self._broken is not None:
            return
        try:
            data = empty(self._port)
        except BROKEN as error:
            self._broken = error
            return
        if data:
            self._unread += data
            self._came_s = self._clock.now_s()
            self._pieces.append((len(data), self._came_s))
            if len(self._unread) > KEPT_BYTES:
                del self._unread[:-KEPT_BYTES]
                del self._pieces[:-KEPT_PIECES]
