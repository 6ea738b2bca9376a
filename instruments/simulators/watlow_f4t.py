"""A simulated Watlow F4T on the world's chamber, over Modbus TCP."""

from __future__ import annotations

import struct
from collections.abc import Callable

from instruments.bench import BenchFile
from instruments.simulators.faults import Faults
from instruments.simulators.modbus_device import ModbusDevice, Register, constant
from instruments.simulators.world import World

PART = "F4T1A1A1A1A1A1A"


def float_words(value: float) -> tuple[int, int]:
    """Return (high, low) word of a 32-bit float."""
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return int(high), int(low)


class SimulatedF4T(ModbusDevice):
    """Low word first unless the bench file says otherwise; Celsius; automatic control."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:  # noqa: ARG002
        self._world, self._little = world, bench.chamber.word_order == "little"
        self._setpoint = 25.0
        self._low, self._high = bench.chamber.min_c, bench.chamber.max_c
        self._words = list(float_words(self._setpoint))
        registers = {
            **{16 + i: constant(ord(letter)) for i, letter in enumerate(PART)},
            90: constant(138),
            6730: constant(15),
            14080: constant(15),
            2730: constant(10),
            2814: constant(10),
            **{1356 + 100 * n: constant(61) for n in range(4)},
            **self._float(2774, lambda _: self._low),
            **self._float(2776, lambda _: self._high),
            **self._float(2820, world.heat.air_c),
            **self._float(2810, lambda _: self._setpoint),
            **self._float(2782, lambda _: self._setpoint, writable=True),
        }
        super().__init__("tcp", registers, faults)

    def _float(self, first: int, get: Callable[[float], float], *, writable: bool = False) -> dict[int, Register]:
        high, low = (first + 1, first) if self._little else (first, first + 1)
        return {
            high: Register(lambda t: float_words(get(t))[0], self._put(0, last=high > low) if writable else None),
            low: Register(lambda t: float_words(get(t))[1], self._put(1, last=low > high) if writable else None),
        }

    def _put(self, word: int, *, last: bool) -> Callable[[int, float], bool]:
        def put(value: int, t_s: float) -> bool:
            self._words[word] = value
            if not last:
                return True
            (asked,) = struct.unpack(">f", struct.pack(">HH", *self._words))
            if not self._low <= asked <= self._high:
                return False
            self._setpoint = asked
            self._world.heat.set(t_s, asked)
            return True

        return put
