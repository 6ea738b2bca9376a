"""A pyserial port whose far end is a simulated instrument; time passes by the Clock, so in virtual time reads jump."""

from __future__ import annotations

from typing import Any

import serial

from instruments.clock import Clock
from instruments.simulators.device import SimulatedDevice

#: A real port keeps so many unread bytes and loses the rest, oldest first.
BUFFER_BYTES = 4096
#: A silent instrument is looked at this often, in case it is woken by somebody else.
LOOK_S = 0.05


def room_bytes(clock: Clock) -> int:
    """Return how much a port keeps unread: a host is held up in the wall's time, however fast the clock runs."""
    return round(BUFFER_BYTES * max(1.0, 1.0 / clock.wall_s(1.0)))


class SimSerial(serial.SerialBase):  # type: ignore[misc]  # pyserial has no types
    """A serial port to a simulated instrument."""

    def __init__(self, device: SimulatedDevice, clock: Clock, **settings: Any) -> None:
        self._device = device
        self._clock = clock
        self._unread = bytearray()
        self._room = room_bytes(clock)
        self.is_open = False
        super().__init__(**settings)
        self.open()

    def open(self) -> None:
        """Open the port."""
        if self.is_open:
            raise serial.SerialException("the port is open already")
        self._unread.clear()
        self.is_open = True

    def close(self) -> None:
        """Close the port; safe to call twice."""
        self.is_open = False

    def _reconfigure_port(self, *_: Any) -> None:
        """Simulated instruments take any line settings."""

    def _take(self) -> None:
        if not self.is_open:
            raise serial.PortNotOpenError
        self._unread += self._device.transmit(self._clock.now_s())
        if len(self._unread) > self._room:
            del self._unread[: -self._room]

    @property
    def in_waiting(self) -> int:
        """How many bytes can be read at once."""
        self._take()
        return len(self._unread)

    def read(self, size: int = 1) -> bytes:
        """Read `size` bytes, or as many as come before the time-out."""
        self._take()
        deadline_s = None if self.timeout is None else self._clock.now_s() + self.timeout
        while len(self._unread) < size:
            now_s = self._clock.now_s()
            if deadline_s is not None and now_s >= deadline_s:
                break
            next_s = self._device.next_byte_s(now_s)
            until_s = now_s + LOOK_S if next_s is None and deadline_s is None else next_s
            if deadline_s is not None:
                until_s = deadline_s if until_s is None else min(until_s, deadline_s)
            self._clock.sleep(max((until_s or 0.0) - now_s, 1e-6))
            self._take()
        found = bytes(self._unread[:size])
        del self._unread[:size]
        return found

    def write(self, data: bytes) -> int:
        """Send bytes to the instrument."""
        if not self.is_open:
            raise serial.PortNotOpenError
        self._device.receive(bytes(data), self._clock.now_s())
        return len(data)

    def flush(self) -> None:
        """Everything is on the wire at once."""

    def reset_input_buffer(self) -> None:
        """Drop what was not read."""
        if not self.is_open:
            raise serial.PortNotOpenError
        self._device.skip(self._clock.now_s())
        self._unread.clear()

    def reset_output_buffer(self) -> None:
        """Nothing waits to be sent."""
