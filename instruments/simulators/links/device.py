"""What one simulated instrument is: bytes in, bytes out, at times of the clock."""

from __future__ import annotations

from typing import Protocol


class SimulatedDevice(Protocol):
    """An instrument at the far end of a wire. It never sleeps and never reads a clock; it is told the time."""

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes from the host at clock time `t_s`."""
        ...

    def transmit(self, t_s: float) -> bytes:
        """Return the bytes that the instrument has put on the wire up to `t_s` since the last call."""
        ...

    def skip(self, t_s: float) -> None:
        """Lose what was put on the wire up to `t_s`: nobody will read it, so it need not be made."""
        ...

    def next_byte_s(self, t_s: float) -> float | None:
        """Return when the next byte comes if the host stays silent; None when it would wait for ever."""
        ...
