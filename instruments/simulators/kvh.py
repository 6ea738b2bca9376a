"""Simulated KVH gyros: lines of text at their own pace."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from instruments.bench_config import BenchFile
from instruments.drivers.kvh import DSP3000, RD2100, LineFormat
from instruments.simulators.links.faults import Faults
from instruments.simulators.physics.world import World

#: Lines that a port can hold: older ones are skipped.
MOST_LINES = 400
RD2100_LSB_DPS = 0.000305


class _SimulatedLines(ABC):
    """Sends a line per sampling interval."""

    format: LineFormat

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:  # noqa: ARG002
        self._unit, self._faults = world.gyro(gyro), faults
        self._rate_hz = self._unit.sample_rate_hz
        self._sent = 0

    def receive(self, data: bytes, t_s: float) -> None:
        """Take mode letters, without an answer; the mode asked for is the one it is in."""
        del data, t_s

    def transmit(self, t_s: float) -> bytes:
        """Return the lines up to now."""
        newest = int(np.floor(t_s * self._rate_hz + 1e-9))
        if newest <= self._sent:
            return b""
        index = np.arange(max(self._sent + 1, newest - MOST_LINES + 1), newest + 1)
        self._sent = newest
        sample = self._unit.sample(index / self._rate_hz)
        lines = [
            self.line(self.format.sign * float(rate[0]), float(warm[0]))
            for rate, warm in zip(sample.rate_dps, sample.temperature_c, strict=True)
        ]
        if self._faults.strike(["wrong_crc"], t_s) is not None:
            lines[0] = "?" + lines[0][1:]
        if (gap := self._faults.strike(["counter_gap"], t_s)) is not None:
            lines = lines[gap.value :]
        return "".join(line + "\r\n" for line in lines).encode("ascii")

    def skip(self, t_s: float) -> None:
        """Lose the lines up to now."""
        self._sent = max(self._sent, int(np.floor(t_s * self._rate_hz + 1e-9)))

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the stream never waits
        """Return when the next line is complete."""
        return (self._sent + 1) / self._rate_hz

    @abstractmethod
    def line(self, rate_dps: float, temperature_c: float) -> str:
        """Return one line without its end."""


class SimulatedDsp3000(_SimulatedLines):
    """19 characters: the rate right-aligned, three spaces, the flag."""

    format = DSP3000

    def line(self, rate_dps: float, temperature_c: float) -> str:  # noqa: ARG002  this line has none
        """Return one line."""
        return f"{rate_dps:15.6f}   {1 if abs(rate_dps) < 500 else 0}"


class SimulatedRd2100(_SimulatedLines):
    """The rate in whole bits of the unit, and the temperature."""

    format = RD2100

    def line(self, rate_dps: float, temperature_c: float) -> str:
        """Return one line."""
        return f"{round(rate_dps / RD2100_LSB_DPS) * RD2100_LSB_DPS:.6f} {temperature_c:.3f}"
