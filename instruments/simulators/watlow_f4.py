"""A simulated Watlow F4 on the world's chamber, over Modbus RTU."""

from __future__ import annotations

from instruments.bench_config import BenchFile
from instruments.simulators.links.faults import Faults
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, constant, int16, items
from instruments.simulators.physics.world import World

ROOM_C = 25.0
EVENTS, INPUTS = 8, 4
STATIC, PROFILE_RUNS = 0, 2


class SimulatedF4(ModbusDevice):
    """Signed counts with implied decimals; what a person sets at its panel are attributes."""

    def __init__(self, world: World, bench: BenchFile, gyro: str, faults: Faults) -> None:  # noqa: ARG002  not a gyro's
        self._world = world
        self.model = 5270
        self.decimals = 1
        self.scale = 1  #: 0: Fahrenheit
        self.units = 0
        self.mode = STATIC
        self.setpoint = round(ROOM_C * self.counts_per_c)
        self.min_c, self.max_c = bench.chamber.min_c, bench.chamber.max_c
        self.on_run_page = True  #: elsewhere it answers writes and does nothing
        self.sensor_code: int | None = None  #: sent instead of a measurement
        self.writes: list[int] = []  #: set points written, as they would wear the EEPROM
        self.inputs, self.input_functions, self.active_states = [0] * INPUTS, [0] * INPUTS, [1] * INPUTS
        self.events = [1] * EVENTS
        if bench.chamber.enable_event is not None:
            self.events[bench.chamber.enable_event - 1] = 0
        super().__init__("rtu", self._make_cells(), faults, bench.chamber.address)

    @property
    def counts_per_c(self) -> int:
        """How many counts one kelvin is."""
        return int(10**self.decimals)

    def _make_cells(self) -> dict[int, Cell]:
        return {
            0: int16(lambda _: self.model),
            100: int16(self._air),
            200: int16(lambda _: self.mode),
            300: int16(lambda _: self.setpoint, self._set),
            602: int16(lambda _: self.min_c * self.counts_per_c),
            603: int16(lambda _: self.max_c * self.counts_per_c),
            606: int16(lambda _: self.decimals),
            608: int16(lambda _: self.units),
            901: int16(lambda _: self.scale),
            1217: Cell(lambda _: (0,), self._terminate),
            **items(201, 12, self.inputs),
            **items(1060, 2, self.input_functions),
            **items(1061, 2, self.active_states),
            **{2000 + 10 * n: self._event(n) for n in range(EVENTS)},
            **{number: constant(0) for number in (1, 2, 5, 600, 607)},
        }

    def _air(self, t_s: float) -> float:
        return self.sensor_code if self.sensor_code is not None else self._world.heat.air_c(t_s) * self.counts_per_c

    def _set(self, counts: int, t_s: float) -> bool:
        if not self.min_c <= counts / self.counts_per_c <= self.max_c:
            return False
        self.writes.append(counts)
        if self.on_run_page:
            self.setpoint = counts
            self._world.heat.set(t_s, counts / self.counts_per_c)
        return True

    def _terminate(self, words: list[int], _t_s: float) -> bool:
        self.mode = STATIC
        return words == [1]

    def _event(self, n: int) -> Cell:
        def put(value: int, _t_s: float) -> bool:
            self.events[n] = value
            return value in {0, 1}

        return int16(lambda _: self.events[n], put)
