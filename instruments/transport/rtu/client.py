"""A Modbus RTU client whose port is opened as every port of a bench: with line settings, locked, or with a reason."""

from __future__ import annotations

from typing import cast

import serial
from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient

from instruments.clock import Clock, Deadline, wait_s
from instruments.transport.opened_port import open_port
from instruments.transport.serial import BROKEN, Line, SerialPort

#: What opening a port raises.
NOT_OPENED: tuple[type[Exception], ...] = (*BROKEN, ValueError)


class RtuClient(ModbusSerialClient):
    """pymodbus opens its port itself, and keeps to itself why it could not."""

    def __init__(self, url: str, clock: Clock, *, baudrate: int, timeout_s: float, line: Line) -> None:
        """Make a client that is not connected yet; `timeout_s` is in s of the clock."""
        super().__init__(url, framer=FramerType.RTU, baudrate=baudrate, timeout=wait_s(clock, timeout_s), retries=0)
        self._url, self._clock, self._baudrate, self._timeout_s, self._line = url, clock, baudrate, timeout_s, line
        self.failure: Exception | None = None  #: why the port could not be opened

    def connect(self) -> bool:
        """Open the port where it is closed; returns whether it is open."""
        if self.socket is None:
            self.failure = None
            try:
                port = open_port(
                    self._url,
                    baudrate=self._baudrate,
                    timeout_s=wait_s(self._clock, self._timeout_s),
                    line=self._line,
                    inter_byte_timeout_s=self.inter_byte_timeout or None,
                )
            except NOT_OPENED as error:
                self.failure = error
            else:
                self.socket = cast("serial.Serial", port)
        return self.socket is not None

    def recv(self, size: int | None) -> bytes:
        """Read what has come, within the time-out; what had come when it ended counts.

        pymodbus counts in real time, and does not look again after a sleep in which the time-out ended.
        """
        deadline = Deadline(self._clock, self._timeout_s)
        while not (data := super().recv(size)):
            is_over = deadline.is_over
            if (waiting := cast("SerialPort", self.socket).in_waiting) or is_over:
                return super().recv(waiting) if waiting else data
        return data
