"""A module with the calls of nidaqmx that the driver makes: scans by a clock of its own, a buffer that may run over."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from instruments.clock import Clock


class DaqError(Exception):
    """As nidaqmx's: text over several lines, and a code."""

    def __init__(self, text: str, code: int) -> None:
        super().__init__(f"{text}\n\nStatus Code: {code}")
        self.error_code = code


class FakeNidaqmx:
    """Holds the volts of each input, and what the last task was asked for."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.volts: dict[int, float] = {}
        self.ppm = 0.0
        self.rate_hz: float | None = None  #: what the hardware makes of the rate that it is asked for
        self.failure: Exception | None = None
        self.requests: list[tuple[Any, ...]] = []
        self.closed = 0
        self.constants = SimpleNamespace(
            TerminalConfiguration=SimpleNamespace(DEFAULT=-1, RSE=10083, NRSE=10078, DIFF=10106),
            AcquisitionType=SimpleNamespace(CONTINUOUS=10123),
        )

    def Task(self) -> Any:  # noqa: N802  as nidaqmx calls it
        """Make a task."""
        return FakeTask(self)


class FakeTask:
    """One task."""

    def __init__(self, module: FakeNidaqmx) -> None:
        self._module = module
        self._inputs: list[int] = []
        self._started_s: float | None = None
        self._read = self._buffer = 0
        self.ai_channels = SimpleNamespace(add_ai_voltage_chan=self._add)
        self.timing = SimpleNamespace(cfg_samp_clk_timing=self._time, samp_clk_rate=0.0)
        self.devices = [SimpleNamespace(product_type="USB-6341")]

    def _add(self, channel: str, *, terminal_config: int, min_val: float, max_val: float) -> None:
        self._module.requests.append((channel, terminal_config, min_val, max_val))
        self._inputs.append(int(channel.rpartition("ai")[2]))

    def _time(self, rate: float, *, sample_mode: int, samps_per_chan: int) -> None:
        self._module.requests.append((rate, sample_mode, samps_per_chan))
        self.timing.samp_clk_rate, self._buffer = self._module.rate_hz or rate, samps_per_chan

    def start(self) -> None:
        self._started_s = self._module.clock.now_s()

    def read(self, number_of_samples_per_channel: int, timeout: float) -> list[Any]:
        assert (number_of_samples_per_channel, timeout) == (-1, 0.0)
        if self._module.failure is not None:
            raise self._module.failure
        assert self._started_s is not None
        rate_hz = self.timing.samp_clk_rate * (1 + 1e-6 * self._module.ppm)
        done = int((self._module.clock.now_s() - self._started_s) * rate_hz + 1e-6)
        new, self._read = done - self._read, done
        if new > self._buffer:
            raise DaqError("The application is not able to keep up with the hardware acquisition.", -200279)
        rows = [np.full(new, self._module.volts.get(n, 0.0)).tolist() for n in self._inputs]
        return rows if len(rows) > 1 else rows[0]  # as nidaqmx: one channel is no list of lists

    def close(self) -> None:
        self._module.closed += 1
