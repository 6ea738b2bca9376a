"""pymodbus clients whose far end is a simulated instrument, served in the calling thread.

Everything above the socket or port is pymodbus's own. Waits take bench clock time, up to the time-out: in virtual time
a silent instrument costs no wall time, and the same bytes come at the same instants in every run.
"""

from __future__ import annotations

import socket
from typing import Any, cast

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ConnectionException

from instruments.clock import Clock
from instruments.simulators.links.device import SimulatedDevice
from instruments.simulators.links.serial_port import SimulatedSerialPort

#: Least step of the clock while a reply is awaited, s.
MIN_WAIT_S = 1e-3
RECEIVE_BYTES = 65536


class SimulatedTcpClient(ModbusTcpClient):
    """A Modbus TCP client on one end of a socket pair; the instrument's bytes are put in at the other."""

    def __init__(self, device: SimulatedDevice, clock: Clock, timeout_s: float, **settings: Any) -> None:
        super().__init__("simulated", **settings)
        self._device, self._clock, self._timeout_s = device, clock, timeout_s
        self._instrument_end: socket.socket | None = None
        self._ready = 0

    def connect(self) -> bool:
        """Open the pair; False when the instrument cannot be reached. Replies to an earlier link are lost."""
        if self.socket is None:
            try:
                self._device.skip(self._clock.now_s())
            except OSError:
                return False
            self.socket, self._instrument_end = socket.socketpair()
            self._ready = 0
        return True

    def close(self) -> None:
        """Close both ends."""
        super().close()
        if self._instrument_end is not None:
            self._instrument_end.close()
            self._instrument_end = None

    def send(self, request: bytes, addr: tuple[str, int] | None = None) -> int:
        """Send a request and hand it to the instrument."""
        sent = int(super().send(request, addr))
        assert self._instrument_end is not None
        try:
            self._device.receive(self._instrument_end.recv(RECEIVE_BYTES), self._clock.now_s())
        except OSError as error:
            self.close()
            raise ConnectionException(f"{self}: {error}") from error
        return sent

    def recv(self, size: int | None) -> bytes:
        """Read what the instrument sends before the time-out; nothing when it stays silent."""
        if not self._ready:
            self._await_bytes()
        if not self._ready:
            return b""
        received = super().recv(size)
        self._ready -= len(received)
        return received

    def _await_bytes(self) -> None:
        deadline_s = self._clock.now_s() + self._timeout_s
        try:
            while not (data := self._device.transmit(now_s := self._clock.now_s())):
                if now_s >= deadline_s - 1e-9:
                    return
                next_s = self._device.next_byte_s(now_s)
                until_s = deadline_s if next_s is None else min(max(next_s, now_s + MIN_WAIT_S), deadline_s)
                self._clock.sleep(until_s - now_s)
        except OSError as error:
            self.close()
            raise ConnectionException(f"{self}: {error}") from error
        if self._instrument_end is not None:
            self._instrument_end.sendall(data)
            self._ready += len(data)


class SimulatedRtuClient(ModbusSerialClient):
    """A Modbus RTU client on a simulated serial port.

    pymodbus waits for RTU replies by sleeping a real millisecond and looking again; the simulated port waits by the
    Clock instead. Dropping stale bytes before a request, framing and checksums stay pymodbus's.
    """

    def __init__(self, device: SimulatedDevice, clock: Clock, timeout_s: float, **settings: Any) -> None:
        super().__init__("simulated", framer=FramerType.RTU, **settings)
        self._device, self._clock, self._timeout_s = device, clock, timeout_s

    def connect(self) -> bool:
        """Open the port; False when the instrument cannot be reached."""
        if self.socket is None:
            port = SimulatedSerialPort(self._device, self._clock, timeout=self._timeout_s)
            try:
                port.reset_input_buffer()
            except OSError:
                return False
            self.socket = cast("serial.Serial", port)  # pymodbus reads, writes, empties and closes it, no more
        return True

    def recv(self, size: int | None) -> bytes:  # noqa: ARG002  a simulated reply comes whole, or is waited for again
        """Read what has come by the time-out: the first bytes and all that came with them."""
        if self.socket is None:
            raise ConnectionException(str(self))
        try:
            first: bytes = self.socket.read(1)
            return first + self.socket.read(self.socket.in_waiting) if first else b""
        except OSError as error:
            self.close()
            raise ConnectionException(f"{self}: {error}") from error
