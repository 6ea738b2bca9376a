"""A simulated ADAM-6017: a Gyrostar's voltage on one input, its thermometer's on another, over Modbus TCP."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from instruments.bench import BenchFile
from instruments.gyrostar import CHANNELS, FULL_CODE, RANGES_V, Options
from instruments.simulators.faults import Faults
from instruments.simulators.modbus_device import ModbusDevice, Register, constant
from instruments.simulators.world import World


class Adam6017(ModbusDevice):
    """The world's Gyrostar as codes of an analog input module; inputs that carry nothing read mid-scale."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:
        settings = next(g for g in bench.gyros if g.name == gyro)
        self._options = Options.model_validate(settings.options)
        self._unit = world.gyro(gyro)
        self._sampled_s = -1.0
        self._codes = [FULL_CODE // 2] * CHANNELS
        ranges = {self._options.channel: self._options.range_code}
        if self._options.thermometer_channel is not None:
            ranges[self._options.thermometer_channel] = self._options.thermometer_range_code
        registers = {
            **{n: Register(self._reader(n)) for n in range(CHANNELS)},
            **{200 + n: constant(ranges.get(n, 0x0143)) for n in range(CHANNELS)},
            210: constant(0x6017),
        }
        super().__init__("tcp", registers, faults)

    def _reader(self, channel: int) -> Callable[[float], int]:
        return lambda t_s: self._code(channel, t_s)

    def _code(self, channel: int, t_s: float) -> int:
        if t_s > self._sampled_s:
            self._sample(t_s)
        return self._codes[channel]

    def _sample(self, t_s: float) -> None:
        self._sampled_s = t_s
        sample = self._unit.sample(np.array([t_s]))
        options = self._options
        volts = options.rest_v + options.v_per_dps * float(sample.rate_dps[0, 0])
        self._codes[options.channel] = _encode(volts, options.range_code)
        if options.thermometer_channel is not None:
            warm = (float(sample.temperature_c[0, 0]) - options.thermometer_zero_c) / options.thermometer_c_per_v
            self._codes[options.thermometer_channel] = _encode(warm, options.thermometer_range_code)


def _encode(volts: float, range_code: int) -> int:
    low, high = RANGES_V[range_code]
    return int(np.clip(round((volts - low) / (high - low) * FULL_CODE), 0, FULL_CODE))
