"""A Modbus TCP client whose time-out counts on the clock of the bench."""

from __future__ import annotations

from pymodbus.client import ModbusTcpClient

from instruments.clock import Clock, Deadline, wait_s


class TcpClient(ModbusTcpClient):
    """pymodbus counts its time-out in real time, by which a clock that stood still meanwhile has hardly moved."""

    def __init__(self, host: str, tcp_port: int, clock: Clock, timeout_s: float) -> None:
        """Make a client that is not connected yet; `timeout_s` is in s of the clock."""
        super().__init__(host, port=tcp_port, timeout=wait_s(clock, timeout_s), retries=0)
        self._clock, self._timeout_s = clock, timeout_s

    def recv(self, size: int | None) -> bytes:
        """Read what has come, within the time-out; what had come when it ended counts."""
        deadline = Deadline(self._clock, self._timeout_s)
        while not (data := super().recv(size)) and not deadline.is_over:
            pass
        return data
