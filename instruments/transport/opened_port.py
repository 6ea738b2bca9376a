"""Opening a real serial port with all its settings: exclusive use, DTR and RTS, RS-485 direction, echo."""

from __future__ import annotations

from typing import Any

from serial.rs485 import RS485Settings

from instruments.protocols.serial_options import Rs485Options
from instruments.transport.latency import lower_latency
from instruments.transport.serial import PARITIES, Line, SerialPort
from instruments.transport.settled_port import unopened

#: A write may take this long, s of real time: pyserial calls one that a busy computer interrupted a failed one.
MIN_WRITE_S = 1.0


def open_port(
    url: str, *, baudrate: int, timeout_s: float, line: Line, inter_byte_timeout_s: float | None = None
) -> SerialPort:
    """Return an open port with 8 data bits, locked for this process; time-outs in s of real time.

    Raises what pyserial raises; ValueError for RS-485 where the port's kernel driver does not switch the direction.
    """
    settings: dict[str, Any] = {
        "baudrate": baudrate, "parity": PARITIES[line.parity], "stopbits": line.stop_bits, "timeout": timeout_s,
        "write_timeout": max(timeout_s, MIN_WRITE_S), "inter_byte_timeout": inter_byte_timeout_s, "exclusive": True,
    }  # fmt: skip
    by_rts = line.rs485 is not None and line.rs485.by == "rts"
    port: Any = unopened(url, settings, switches_direction=by_rts)
    if line.dtr is not None:
        port.dtr = line.dtr
    if line.rts is not None:
        port.rts = line.rts
    port.open()
    lower_latency(port)
    if line.rs485 is not None:
        try:
            port.rs485_mode = _direction(line.rs485)
        except ValueError as error:
            port.close()
            raise ValueError(
                f"the kernel driver of this port cannot switch the RS-485 direction; set rs485 = {{ by = 'rts' "
                f"}}, or leave rs485 "
                f"out where the adapter switches by itself ({error})"
            ) from error
    return EchoFreePort(port) if line.echo else port


def _direction(options: Rs485Options) -> RS485Settings:
    return RS485Settings(
        rts_level_for_tx=options.send_level,
        rts_level_for_rx=not options.send_level,
        delay_before_tx=options.delay_before_send_s or None,
        delay_before_rx=options.delay_after_send_s or None,
    )


class EchoFreePort:
    """An open port whose adapter echoes what is sent: the echo is dropped, the answer behind it is passed on.

    Bytes that differ from what was sent end the echo: from there on everything is passed on. For one thread.
    """

    def __init__(self, port: SerialPort) -> None:
        self._port = port
        self._awaited = b""  #: sent, and not yet come back
        self._kept = bytearray()

    @property
    def is_open(self) -> bool:
        """Whether the port is open."""
        return bool(getattr(self._port, "is_open", True))

    @property
    def timeout(self) -> float | None:
        """Longest wait of `read`, s; None: without end."""
        return self._port.timeout

    @timeout.setter
    def timeout(self, timeout: float | None) -> None:
        self._port.timeout = timeout

    @property
    def in_waiting(self) -> int:
        """Number of bytes, without the echo, that can be read without waiting."""
        if waiting := self._port.in_waiting:
            self._take(self._port.read(waiting))
        return len(self._kept)

    def read(self, size: int = 1, /) -> bytes:
        """Read `size` bytes behind the echo, or as many as arrive before the time-out."""
        while len(self._kept) < size:
            data = self._port.read(len(self._awaited) + size - len(self._kept))
            if not data:
                break
            self._take(data)
        chunk = bytes(self._kept[:size])
        del self._kept[:size]
        return chunk

    def write(self, data: bytes, /) -> int | None:
        """Send bytes, and expect them back."""
        self._awaited += bytes(data)
        return self._port.write(data)

    def reset_input_buffer(self) -> None:
        """Drop unread bytes; what is still to come of an echo is dropped when it comes."""
        if waiting := self._port.in_waiting:
            self._take(self._port.read(waiting))
        self._kept.clear()

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self._port.close()

    def _take(self, data: bytes) -> None:
        for n, byte in enumerate(data):
            if not self._awaited:
                self._kept += data[n:]
                return
            if byte != self._awaited[0]:
                self._awaited = b""
                self._kept += data[n:]
                return
            self._awaited = self._awaited[1:]
