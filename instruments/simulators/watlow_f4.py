"""A simulated Watlow F4 on the world's chamber, over Modbus RTU."""

from __future__ import annotations

from instruments.bench import BenchFile
from instruments.simulators.faults import Faults
from instruments.simulators.modbus_device import ModbusDevice, Register, constant
from instruments.simulators.world import World

DECIMALS = 1
PER_C = 10**DECIMALS


class SimulatedF4(ModbusDevice):
    """One decimal, Celsius, static control."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:  # noqa: ARG002
        self._world = world
        self._setpoint = round(25.0 * PER_C)
        self._low, self._high = round(bench.chamber.min_c * PER_C), round(bench.chamber.max_c * PER_C)
        registers = {
            0: constant(5270),
            100: Register(lambda t: round(world.heat.air_c(t) * PER_C)),
            200: constant(0),
            300: Register(lambda _: self._setpoint, self._set),
            602: constant(self._low),
            603: constant(self._high),
            606: constant(DECIMALS),
            608: constant(0),
            901: constant(1),
            1217: Register(lambda _: 0, lambda _value, _t: True),
            **{201 + 12 * n: constant(0) for n in range(4)},
            **{1060 + 2 * n: constant(0) for n in range(4)},
            **{1061 + 2 * n: constant(1) for n in range(4)},
            **{2000 + 10 * n: Register(lambda _: 1, lambda _value, _t: True) for n in range(8)},
        }
        super().__init__("rtu", registers, faults, bench.chamber.address)

    def _set(self, word: int, t_s: float) -> bool:
        value = word - 0x10000 if word >= 0x8000 else word
        if not self._low <= value <= self._high:
            return False
        self._setpoint = value
        self._world.heat.set(t_s, value / PER_C)
        return True
