"""Simulated KVH gyros: one text line per sampling interval, whether or not the port is read."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from instruments.protocols.kvh_lines import DSP3000, RD2100, LineFormat
from instruments.simulators.setup import InstrumentSetup

#: Lines that a port can hold; older ones are lost.
MAX_LINES = 400
#: A DSP-3000 clears its valid flag beyond this rate.
DSP3000_FLAG_DPS = 500
RD2100_LSB_DPS = 0.000305


class _SimulatedLines(ABC):
    """Sends a line per sampling interval."""

    format: LineFormat

    def __init__(self, setup: InstrumentSetup) -> None:
        self._unit, self._faults = setup.unit, setup.faults
        self._rate_hz = self._unit.sample_rate_hz
        self._sent = 0

    def receive(self, data: bytes, t_s: float) -> None:
        """Take mode letters without a reply; the requested mode is the present one."""
        del data, t_s

    def transmit(self, t_s: float) -> bytes:
        """Return the lines up to `t_s`."""
        newest = int(np.floor(t_s * self._rate_hz + 1e-9))
        if newest <= self._sent:
            return b""
        index = np.arange(max(self._sent + 1, newest - MAX_LINES + 1), newest + 1)
        self._sent = newest
        sample = self._unit.sample(index / self._rate_hz)
        lines = [
            self.line(self.format.sign * float(rate[0]), float(temperature_c[0]))
            for rate, temperature_c in zip(sample.rate_dps, sample.temperature_c, strict=True)
        ]
        if self._faults.trigger(["wrong_crc"], t_s) is not None:
            lines[0] = "?" + lines[0][1:]
        if (gap := self._faults.trigger(["counter_gap"], t_s)) is not None:
            lines = lines[gap.value :]
        return "".join(line + "\r\n" for line in lines).encode("ascii")

    @property
    def newest_s(self) -> float:
        """When the newest line was complete, s."""
        return self._sent / self._rate_hz

    def skip(self, t_s: float) -> None:
        """Drop the lines up to `t_s`."""
        self._sent = max(self._sent, int(np.floor(t_s * self._rate_hz + 1e-9)))

    def next_byte_s(self, t_s: float) -> float | None:  # noqa: ARG002  the stream never waits
        """Return when the next line is complete."""
        return (self._sent + 1) / self._rate_hz

    @abstractmethod
    def line(self, rate_dps: float, temperature_c: float) -> str:
        """Return one line without its line end."""


class SimulatedDsp3000(_SimulatedLines):
    """19 characters: the rate right-aligned, three spaces, the flag."""

    format = DSP3000

    def line(self, rate_dps: float, temperature_c: float) -> str:  # noqa: ARG002  the line has no temperature
        """Return one line."""
        return f"{rate_dps:15.6f}   {1 if abs(rate_dps) < DSP3000_FLAG_DPS else 0}"


class SimulatedRd2100(_SimulatedLines):
    """The rate in whole steps of the unit's resolution, and the temperature."""

    format = RD2100

    def line(self, rate_dps: float, temperature_c: float) -> str:
        """Return one line."""
        return f"{round(rate_dps / RD2100_LSB_DPS) * RD2100_LSB_DPS:.6f} {temperature_c:.3f}"
