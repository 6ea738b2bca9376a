"""A pyserial port to a simulated instrument; reads wait on the bench clock: in virtual time at no cost."""

from __future__ import annotations

from typing import Any

import serial
from typing_extensions import Buffer

from instruments.clock import Clock
from instruments.simulators.links.device import SimulatedDevice

#: A real port keeps this many unread bytes and loses the rest, oldest first.
BUFFER_BYTES = 4096
#: Polling period of a silent instrument, s: another link may make it send.
POLL_S = 0.05


def port_buffer_bytes(clock: Clock) -> int:
    """Return the unread bytes that a port keeps; more for a fast clock, since the host is delayed in wall time."""
    return round(BUFFER_BYTES * max(1.0, 1.0 / clock.wall_s(1.0)))


class SimulatedSerialPort(serial.SerialBase):
    """A serial port to a simulated instrument."""

    def __init__(self, device: SimulatedDevice, clock: Clock, **settings: Any) -> None:
        self._device = device
        self._clock = clock
        self._unread = bytearray()
        self._buffer_bytes = port_buffer_bytes(clock)
        self.is_open = False
        super().__init__(**settings)
        self.open()

    def open(self) -> None:
        """Open the port."""
        if self.is_open:
            raise serial.SerialException("the port is open already; close it first")
        self._unread.clear()
        self.is_open = True

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self.is_open = False

    def _reconfigure_port(self, *_: Any) -> None:
        """Accept any line settings."""

    def _receive(self) -> None:
        if not self.is_open:
            raise serial.PortNotOpenError
        self._unread += self._device.transmit(self._clock.now_s())
        if len(self._unread) > self._buffer_bytes:
            del self._unread[: -self._buffer_bytes]

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read without waiting."""
        self._receive()
        return len(self._unread)

    @property
    def newest_s(self) -> float | None:
        """Clock time at which the newest byte was sent; None where the instrument does not tell."""
        device_newest_s = getattr(self._device, "newest_s", None)
        return None if device_newest_s is None else float(device_newest_s)

    def read(self, size: int = 1) -> bytes:
        """Read `size` bytes, or as many as come before the time-out."""
        self._receive()
        deadline_s = None if self.timeout is None else self._clock.now_s() + self.timeout
        while len(self._unread) < size:
            now_s = self._clock.now_s()
            if deadline_s is not None and now_s >= deadline_s:
                break
            next_s = self._device.next_byte_s(now_s)
            until_s = now_s + POLL_S if next_s is None and deadline_s is None else next_s
            if deadline_s is not None:
                until_s = deadline_s if until_s is None else min(until_s, deadline_s)
            self._clock.sleep(max((until_s or 0.0) - now_s, 1e-6))
            self._receive()
        data = bytes(self._unread[:size])
        del self._unread[:size]
        return data

    def write(self, data: Buffer, /) -> int:
        """Send bytes to the instrument."""
        if not self.is_open:
            raise serial.PortNotOpenError
        sent = bytes(data)
        self._device.receive(sent, self._clock.now_s())
        return len(sent)

    def flush(self) -> None:
        """Do nothing: written bytes arrive at once."""

    def reset_input_buffer(self) -> None:
        """Drop unread bytes."""
        if not self.is_open:
            raise serial.PortNotOpenError
        self._device.skip(self._clock.now_s())
        self._unread.clear()

    def reset_output_buffer(self) -> None:
        """Do nothing: no byte waits to be sent."""
