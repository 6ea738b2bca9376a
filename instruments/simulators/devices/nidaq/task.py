"""A task of the simulated driver software: its channels, its sample clock, its buffer."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from instruments.protocols.analog_settings import NidaqSettings
from instruments.protocols.nidaqmx.service import TEXTS, Status
from instruments.simulators.physics.world import SimulatedGyro

#: The clock of the device divides this, Hz.
TIMEBASE_HZ = 100e6
#: Codes of the converter over its whole range.
CODES = 65536
#: Reply to a request for all samples: how many there are is asked before.
ALL_AVAILABLE = -1


class DaqFailure(Exception):
    """A request that the driver software refuses."""

    def __init__(self, status: Status) -> None:
        super().__init__(TEXTS[status])
        self.status = status


class Inputs:
    """The analog inputs: the gyro of the simulated world at those of the bench file, 0 V at the others.

    `volts` holds the constant voltage of inputs that a test sets; `rate_hz` is what the device makes of the rate that
    it is asked for (None: the nearest that its clock can make), and `clock_ppm` the error of its clock.
    """

    def __init__(self, settings: NidaqSettings, unit: SimulatedGyro) -> None:
        self.device, self.product = settings.device, "USB-6341"
        self.numbers = range(16)
        self.volts: dict[int, float] = {}
        self.rate_hz: float | None = None
        self.clock_ppm = unit.truth.sample_clock_ppm
        self._options, self._unit = settings.options, unit

    def coerced_hz(self, rate_hz: float) -> float:
        """Return the rate that the device makes, in scans per second by its own clock."""
        return self.rate_hz or TIMEBASE_HZ / round(TIMEBASE_HZ / rate_hz)

    def sample(self, numbers: list[int], range_v: float, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the volts (inputs, n) of inputs at rising times (n,) s, in steps of the converter."""
        options, sample = self._options, self._unit.sample(t_s)
        found = np.zeros((len(numbers), len(t_s)))
        rates_v = options.rest_v + options.v_per_dps * sample.rate_dps
        for row, number in enumerate(numbers):
            if number in self.volts:
                found[row] = self.volts[number]
            elif number in options.inputs:
                found[row] = rates_v[:, options.inputs.index(number)]
            elif number == options.thermometer_input:
                warm_c = sample.temperature_c[:, 0] - options.thermometer_zero_c
                found[row] = warm_c / options.thermometer_c_per_v
        step_v = 2 * range_v / CODES
        return np.clip(np.rint(found / step_v) * step_v, -range_v, range_v)


@dataclass
class Task:
    """One task. A scan has one sample of each channel."""

    inputs: Inputs
    numbers: list[int] = field(default_factory=list)  #: of the inputs, in the order of the channels
    range_v: float = 10.0
    rate_hz: float = 1000.0
    buffer: int = 1000  #: scans
    started_s: float | None = None
    taken: int = 0  #: scans that were read

    @property
    def channels(self) -> str:
        """Names of the channels, as one text."""
        return ", ".join(f"{self.inputs.device}/ai{number}" for number in self.numbers)

    def add(self, physical: str, range_v: float) -> None:
        """Add a channel; raises DaqFailure for one that the device does not have."""
        device, _, name = physical.partition("/ai")
        if device != self.inputs.device:
            raise DaqFailure(Status.DEVICE_UNKNOWN)
        if not name.isdecimal() or int(name) not in self.inputs.numbers:
            raise DaqFailure(Status.CHANNEL_UNKNOWN)
        self.numbers.append(int(name))
        self.range_v = range_v

    def start(self, t_s: float) -> None:
        """Begin to scan."""
        self.started_s, self.taken = t_s, 0

    def available(self, t_s: float) -> int:
        """Return how many scans were made by `t_s` and not read, also those that the buffer has lost."""
        if self.started_s is None:
            return 0
        return int(np.floor((t_s - self.started_s) * self._true_hz + 1e-6)) - self.taken

    def read(self, count: int, t_s: float) -> tuple[Status | None, NDArray[np.float64]]:
        """Return the next scans as volts (channels, n), with a status where there are fewer; raises DaqFailure."""
        there = self.available(t_s)
        if self.started_s is None or there > self.buffer:
            raise DaqFailure(Status.OVERRUN if there else Status.NOT_YET_AVAILABLE)
        wanted = there if count == ALL_AVAILABLE else min(count, there)
        index = self.taken + 1 + np.arange(wanted)
        self.taken += wanted
        volts = self.inputs.sample(self.numbers, self.range_v, self.started_s + index / self._true_hz)
        return (Status.NOT_YET_AVAILABLE if wanted < count else None), volts

    @property
    def _true_hz(self) -> float:
        return self.rate_hz * (1.0 + 1e-6 * self.inputs.clock_ppm)
