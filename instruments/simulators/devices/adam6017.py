"""A simulated ADAM-6017 over Modbus TCP: the voltages of a Gyrostar and of a thermometer as input codes."""

from __future__ import annotations

from functools import partial

import numpy as np

from instruments.bench_config import part_of
from instruments.protocols.adam6017 import (
    CHANNELS,
    FULL_CODE,
    INPUT,
    MODULE_6017,
    MODULE_NAME,
    RANGE_CODE,
    RANGES_V,
    GyrostarSettings,
)
from instruments.simulators.links.modbus_device import ModbusDevice, int16, items
from instruments.simulators.setup import InstrumentSetup

#: Range code of an input that carries nothing.
UNUSED_RANGE = 0x0143


def code_of(volts: float, range_code: int) -> int:
    """Return the unsigned 16-bit code of a voltage, V: 0 and 65535 at the ends of the range, clipped beyond them."""
    low, high = RANGES_V[range_code]
    return round(min(max((volts - low) / (high - low), 0.0), 1.0) * FULL_CODE)


class SimulatedAdam6017(ModbusDevice):
    """The world's Gyrostar as codes of the module's inputs; unused inputs read mid-scale."""

    def __init__(self, setup: InstrumentSetup) -> None:
        self._wiring = part_of(setup.gyro, GyrostarSettings).options
        self._unit = setup.unit
        self._sampled_s = float("-inf")
        self.module_name = MODULE_6017
        self.codes = [FULL_CODE // 2] * CHANNELS
        self.ranges = [self._wiring.range_codes.get(n, UNUSED_RANGE) for n in range(CHANNELS)]
        cells = {
            **{INPUT.number + n: int16(partial(self._code, n)) for n in range(CHANNELS)},
            **items(RANGE_CODE.number, 1, self.ranges),
            MODULE_NAME.number: int16(lambda _: self.module_name),
        }
        super().__init__("tcp", cells, setup.faults, self._wiring.address)

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
