"""A simulated Watlow F4T on the world's chamber, over Modbus TCP."""

from __future__ import annotations

from instruments.bench_config import BenchFile
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, constant, float32, int16, items
from instruments.simulators.physics.world import World

ROOM_C = 25.0
ALARMS = 4
AUTO, QUIET, NO_PROFILE = 10, 61, 1782


class SimulatedF4T(ModbusDevice):
    """Low word first unless the bench file says otherwise; what a person sets at its panel are attributes."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:  # noqa: ARG002  not a gyro's
        self._world = world
        self._order = bench.chamber.word_order
        self.part_number = [ord(letter) for letter in "F4T1A1A1A1A1A1A"]
        self.status = 138
        self.units = 15  #: 30: Fahrenheit
        self.control_mode = AUTO
        self.profile_state = NO_PROFILE
        self.alarms = [QUIET] * ALARMS
        self.setpoint_c = ROOM_C
        self.min_c, self.max_c = bench.chamber.min_c, bench.chamber.max_c
        self.writes: list[float] = []  #: set points written, as they would wear the EEPROM
        super().__init__("tcp", self._make_cells(), faults, bench.chamber.address)

    def _make_cells(self) -> dict[int, Cell]:
        order = self._order
        return {
            **items(16, 1, self.part_number),
            90: int16(lambda _: self.status),
            6730: int16(lambda _: self.units),
            14080: int16(lambda _: self.units),
            2730: constant(AUTO),
            2814: int16(lambda _: self.control_mode),
            16566: Cell(lambda _: (0,), self._act),
            16568: int16(lambda _: self.profile_state),
            **items(1356, 100, self.alarms),
            2774: float32(order, lambda _: self.min_c),
            2776: float32(order, lambda _: self.max_c),
            2782: float32(order, lambda _: self.setpoint_c, self._set),
            2810: float32(order, lambda _: self.setpoint_c),
            2820: float32(order, self._world.heat.air_c),
        }

    def _set(self, temperature_c: float, t_s: float) -> bool:
        if not self.min_c <= temperature_c <= self.max_c:
            return False
        self.writes.append(temperature_c)
        self.setpoint_c = temperature_c
        self._world.heat.set(t_s, temperature_c)
        return True

    def _act(self, words: list[int], _t_s: float) -> bool:
        self.profile_state = NO_PROFILE
        return words == [148]
