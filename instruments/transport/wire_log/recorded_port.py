"""An open port, and the reader of a stream, whose every operation is an event of a wire log."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from instruments.transport.serial import BROKEN, SerialPort
from instruments.transport.stream_reader import Received, StreamReader
from instruments.transport.wire_log.document import Kind

#: Adds an event of one port: its kind, its bytes and what else is known.
Note = Callable[..., None]
ResultT = TypeVar("ResultT")


def noted(
    note: Note, at: str, operation: Callable[[], ResultT], failures: tuple[type[Exception], ...] = BROKEN
) -> ResultT:
    """Return what an operation on a port returns; its failure becomes an event and is raised."""
    try:
        return operation()
    except failures as error:
        note("failed", at=at, text_of_error=str(error))
        raise


class RecordedPort:
    """A port of pyserial, real or simulated. `raw` is the port itself, for a reader that is recorded on its own."""

    def __init__(self, raw: SerialPort, note: Note) -> None:
        self.raw, self._note = raw, note
        self._kept = bytearray()  #: received to learn how much waits, and not yet read
        self._is_closed = False

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return bool(getattr(self.raw, "is_open", not self._is_closed))

    @property
    def timeout(self) -> float | None:
        """Longest wait of `read`, s; None: without end."""
        return self.raw.timeout

    @timeout.setter
    def timeout(self, timeout: float | None) -> None:
        self.raw.timeout = timeout

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        if waiting := noted(self._note, "received", lambda: self.raw.in_waiting):
            data = noted(self._note, "received", lambda: self.raw.read(waiting))
            self._note("received", data)
            self._kept += data
        return len(self._kept)

    def read(self, size: int = 1, /) -> bytes:
        """Read `size` bytes, or as many as arrive before the time-out."""
        if (missing := size - len(self._kept)) > 0:
            data = noted(self._note, "received", lambda: self.raw.read(missing))
            self._note("received", data, **({} if len(data) == missing else {"timed_out": True}))
            self._kept += data
        found = bytes(self._kept[:size])
        del self._kept[:size]
        return found

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""
        sent: int | None = noted(self._note, "sent", lambda: self.raw.write(data))
        self._note("sent", bytes(data))
        return sent

    def reset_input_buffer(self) -> None:
        """Drop unread bytes."""
        self._kept.clear()
        noted(self._note, "received", self.raw.reset_input_buffer)

    def flush(self) -> None:
        """Wait until everything is sent, where the port can."""
        if (flush := getattr(self.raw, "flush", None)) is not None:
            noted(self._note, "sent", flush)

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self.raw.close()
        if not self._is_closed:
            self._is_closed = True
            self._note("closed")


class RecordedReader:
    """The reader of a port; each call of `take` is one event, as the times of readings follow from these calls."""

    def __init__(self, reader: StreamReader, note: Note) -> None:
        self._reader, self._note = reader, note

    def take(self) -> Received:
        """Return everything that has come since the last call."""
        found: Received = noted(self._note, "arrived", self._reader.take)
        arrived: Kind = "arrived"
        known = {"now_s": found.now_s, "newest_s": found.newest_s, "width_s": found.width_s}
        self._note(arrived, found.data, **{key: value for key, value in known.items() if value is not None})
        return found

    def discard(self) -> None:
        """Drop everything that was not taken yet."""
        noted(self._note, "arrived", self._reader.discard)

    def close(self) -> None:
        """End reading; the port stays open."""
        self._reader.close()
