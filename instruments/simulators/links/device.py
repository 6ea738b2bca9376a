"""Interface of every simulated instrument: bytes in, bytes out, at clock times."""

from __future__ import annotations

from typing import Protocol, cast


class SimulatedDevice(Protocol):
    """An instrument at the far end of a wire. It never sleeps and reads no clock: each call passes the time, s."""

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes from the host at clock time `t_s`."""
        ...

    def transmit(self, t_s: float) -> bytes:
        """Return the bytes that the instrument sent since the last call, up to `t_s`."""
        ...

    def skip(self, t_s: float) -> None:
        """Drop the bytes sent up to `t_s` without making them."""
        ...

    def next_byte_s(self, t_s: float) -> float | None:
        """Return when the next byte comes if the host stays silent, s; None when none will come."""
        ...


def connected(device: SimulatedDevice) -> SimulatedDevice:
    """Return the link that a new connection has: its own where the instrument answers each by itself (`connect`)."""
    connect = getattr(device, "connect", None)
    return device if connect is None else cast("SimulatedDevice", connect())
