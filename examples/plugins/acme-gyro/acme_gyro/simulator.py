"""A simulated Acme G1: sends its lines whether or not the port is read."""

from __future__ import annotations

import numpy as np

from acme_gyro.protocol import C_PER_COUNT, DPS_PER_COUNT, encode
from instruments.simulators.setup import InstrumentSetup

#: Lines that a port can hold; older ones are lost.
MAX_LINES = 400


class SimulatedG1:
    """Sends a line per sampling interval of the world's unit."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self._unit = setup.unit
        self._rate_hz = setup.unit.sample_rate_hz
        self._sent = 0

    def receive(self, data: bytes, t_s: float) -> None:
        """Take bytes: the G1 has no commands."""

    def transmit(self, t_s: float) -> bytes:
        """Return the lines up to `t_s`."""
        newest = self._newest(t_s)
        if newest <= self._sent:
            return b""
        index = np.arange(max(self._sent + 1, newest - MAX_LINES + 1), newest + 1)
        self._sent = newest
        sample = self._unit.sample(index / self._rate_hz)
        rates = np.rint(sample.rate_dps[:, 0] / DPS_PER_COUNT).astype(int)
        warm = np.rint(sample.temperature_c[:, 0] / C_PER_COUNT).astype(int)
        return b"".join(encode(*line) for line in zip(index.tolist(), rates.tolist(), warm.tolist(), strict=True))

    def skip(self, t_s: float) -> None:
        """Lose the lines up to `t_s`."""
        self._sent = max(self._sent, self._newest(t_s))

    def next_byte_s(self, t_s: float) -> float | None:
        """Return when the next line is complete."""
        return (self._sent + 1) / self._rate_hz

    def _newest(self, t_s: float) -> int:
        return int(np.floor(t_s * self._rate_hz + 1e-9))
