"""A simulated ADAM-6017: a Gyrostar's voltage on one input, its thermometer's on another, over Modbus TCP."""

from __future__ import annotations

from functools import partial

import numpy as np

from instruments.bench_config import BenchFile
from instruments.drivers.gyrostar import CHANNELS, FULL_CODE, RANGES_V, Options
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.modbus_device import ModbusDevice, int16, items
from instruments.simulators.physics.world import World

UNUSED_RANGE = 0x0143


def code_of(volts: float, range_code: int) -> int:
    """Return the unsigned 16-bit code of a voltage: 0 and 65535 are the ends of the range, beyond them it clips."""
    low, high = RANGES_V[range_code]
    return round(min(max((volts - low) / (high - low), 0.0), 1.0) * FULL_CODE)


class Adam6017(ModbusDevice):
    """The world's Gyrostar as codes of the module's inputs; inputs that carry nothing read mid-scale."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:
        settings = next(g for g in bench.gyros if g.name == gyro)
        self._wiring = Options.model_validate(settings.options)
        self._unit = world.gyro(gyro)
        self._sampled_s = float("-inf")
        self.module_name = 0x6017
        self.codes = [FULL_CODE // 2] * CHANNELS
        self.ranges = [self._wiring.wired.get(n, UNUSED_RANGE) for n in range(CHANNELS)]
        cells = {
            **{n: int16(partial(self._code, n)) for n in range(CHANNELS)},
            **items(200, 1, self.ranges),
            210: int16(lambda _: self.module_name),
        }
        super().__init__("tcp", cells, faults, self._wiring.address)

    def _code(self, channel: int, t_s: float) -> int:
        if t_s > self._sampled_s:
            self._sample(t_s)
        return self.codes[channel]

    def _sample(self, t_s: float) -> None:
        self._sampled_s = t_s
        sample, wiring = self._unit.sample(np.array([t_s])), self._wiring
        volts = wiring.rest_v + wiring.v_per_dps * float(sample.rate_dps[0, 0])
        self.codes[wiring.channel] = code_of(volts, wiring.range_code)
        if wiring.thermometer_channel is not None:
            volts = (float(sample.temperature_c[0, 0]) - wiring.thermometer_zero_c) / wiring.thermometer_c_per_v
            self.codes[wiring.thermometer_channel] = code_of(volts, wiring.thermometer_range_code)
