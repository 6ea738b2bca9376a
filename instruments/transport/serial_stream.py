"""Serial port of a device that sends unsolicited; a broken wire becomes a LinkError that names the device."""

from __future__ import annotations

from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from instruments.clock import Clock, sleep_until
from instruments.errors import LinkError
from instruments.protocols.serial_options import SerialOptions
from instruments.transport.factory import Ports
from instruments.transport.port_failures import silence_remedy
from instruments.transport.serial import BROKEN, EIGHT_N_1, Line, SerialPort
from instruments.transport.stream_reader import Received, StreamReader

#: Clock seconds that count as no time: rounding of sums of durations.
TINY_S = 1e-9


def line_of(options: SerialOptions) -> Line:
    """Return the electrical settings that a bench file gives."""
    return Line(options.parity, options.stop_bits, options.dtr, options.rts, options.echo, options.rs485)


class SerialStream:
    """One serial port, opened by `open` and read as bytes on the bench clock. Every failure is a LinkError.

    A real port is read all the time by a thread of its own; nothing is lost while the caller does something else.
    """

    def __init__(
        self,
        device: str,
        url: str,
        ports: Ports,
        clock: Clock,
        *,
        baudrate: int,
        timeout_s: float,
        line: Line = EIGHT_N_1,
    ) -> None:
        self._device, self._url = device, url
        self._ports, self._clock = ports, clock
        self._baudrate, self._timeout_s, self._line = baudrate, timeout_s, line
        self._port: SerialPort | None = None
        self._reader: StreamReader | None = None
        self.last = Received(b"", clock.now_s())  #: what was read last: its time is that of the bytes returned last
        self._pieces: list[tuple[int, float]] = []  #: of what `read_for` or `read_available` returned last
        self.unused = 0  #: bytes that came since the last reading; the driver sets it to 0
        self._answers = 0  #: of these, what the driver has asked for

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return self._port is not None

    def open(self) -> None:
        """Open the port unless it is open; raises LinkError."""
        if self._port is None:
            self._port = self._ports.serial(
                self._url, device=self._device, baudrate=self._baudrate, timeout_s=self._timeout_s, line=self._line
            )
            self._reader = self._ports.stream_reader(self._url, self._port)

    def close(self) -> None:
        """Close the port; safe to call twice."""
        if self._reader is not None:
            self._reader.close()
            self._reader = None
        if self._port is not None:
            self._port.close()
            self._port = None

    def write(self, data: bytes) -> None:
        """Send bytes; raises LinkError."""
        self._reading()
        assert self._port is not None
        try:
            self._port.write(data)
        except BROKEN as error:
            self._fail(error)

    def discard_input(self) -> None:
        """Drop every byte that was not read yet; raises LinkError."""
        self.unused = self._answers = 0
        try:
            self._reading().discard()
        except BROKEN as error:
            self._fail(error)

    def read_available(self) -> bytes:
        """Return the bytes that have arrived, without waiting; raises LinkError."""
        self._pieces.clear()
        return self._read()

    def arrival_s(self, behind: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return when the bytes that were read last arrived, clock time (n,).

        `behind` (n,) is how many bytes arrived after each. Bytes that arrived together have one time, that of the last.
        """
        if not self._pieces:
            return np.full(len(behind), self.last.now_s)
        sizes, times = np.array(self._pieces[::-1], dtype=np.float64).T
        piece = np.searchsorted(np.cumsum(sizes), behind, side="right")
        return np.asarray(times[np.minimum(piece, len(times) - 1)], dtype=np.float64)

    def _read(self) -> bytes:
        """Return the bytes that have arrived, and note their times; raises LinkError."""
        reader = self._reading()
        try:
            self.last = reader.take()
        except BROKEN as error:
            self._fail(error)
        last = self.last
        if not self.unused:
            self._answers = 0
        self.unused += len(last.data)
        if last.data:
            came_s = last.now_s if last.newest_s is None else last.newest_s
            self._pieces += last.pieces or [(len(last.data), came_s)]
        return last.data

    def answered(self, n_bytes: int) -> None:
        """Note that so many of the bytes that came are an answer to what the driver asked."""
        self._answers += n_bytes

    def advice(self, sent_as: str) -> str:
        """Return what came where a reading should have, and what to check; `sent_as` names what readings depend on."""
        strange = max(self.unused - self._answers, 0)
        if self.unused and not strange:
            return (
                f"the unit answers questions ({self.unused} bytes) but sends no reading; check that it measures, that "
                f"nothing else has to trigger it, and {sent_as}"
            )
        if not strange:
            return f"no bytes arrived; check {silence_remedy(self._url)} and {sent_as}"
        return f"{strange} bytes arrived that are not readings; check {sent_as}, and what else sends on this line"

    def read_for(self, duration_s: float, every_s: float) -> bytes:
        """Return the bytes of the next `duration_s` clock seconds; the port is emptied every `every_s` seconds.

        Raises LinkError.
        """
        end_s = self._clock.now_s() + duration_s
        data = b""
        self._pieces.clear()
        while True:
            sleep_until(self._clock, min(self._clock.now_s() + every_s, end_s))
            data += self._read()
            if self._clock.now_s() >= end_s - TINY_S:
                return data

    def _reading(self) -> StreamReader:
        if self._reader is None:
            raise LinkError(self._device, f"the stream on {self._url} was not started; start it first")
        return self._reader

    def _fail(self, error: Exception) -> NoReturn:
        self.close()
        raise LinkError(
            self._device,
            f"the link {self._url} broke ({error}); check the cable; the stream must be started again",
        ) from error
