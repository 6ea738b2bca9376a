"""A simulated Watlow F4 on the world's chamber, over Modbus RTU."""

from __future__ import annotations

from instruments.bench_config import part_of
from instruments.protocols import watlow_f4_registers as f4
from instruments.protocols.watlow_settings import WatlowSettings
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, constant, int16, items
from instruments.simulators.setup import InstrumentSetup

AMBIENT_C = 25.0
#: Registers that exist on the controller and that no driver reads.
UNUSED_REGISTERS = (1, 2, 5, 600, 607)


class SimulatedF4(ModbusDevice):
    """Signed counts with implied decimals; the settings of its front panel are attributes."""

    def __init__(self, setup: InstrumentSetup) -> None:
        chamber = part_of(setup.instrument("chamber"), WatlowSettings)
        self._world = setup.world
        self.model = f4.MODEL_F4
        self.decimals = 1
        self.scale = 1  #: 0: Fahrenheit
        self.units = f4.UNITS_TEMPERATURE
        self.mode = f4.MODE_STATIC
        self.setpoint = round(AMBIENT_C * self.counts_per_c)
        self.min_c, self.max_c = chamber.min_c, chamber.max_c
        self.on_run_page = True  #: on another page it acknowledges writes and ignores them
        self.sensor_code: int | None = None  #: sent instead of a measurement
        self.writes: list[int] = []  #: every written set point: each one wears the EEPROM
        self.inputs, self.input_functions, self.active_states = [0] * f4.INPUTS, [0] * f4.INPUTS, [1] * f4.INPUTS
        self.events = [1] * f4.EVENTS
        self.profile = 1  #: current one, while the mode says that one runs
        self.alarm_words = [0] * (f4.AIR_COUNTS[0] - 1)  #: from register 101 on
        self._enabling = None if chamber.enable_event is None else chamber.enable_event - 1
        if self._enabling is not None:
            self.events[self._enabling] = 0
        super().__init__("rtu", self._make_cells(), setup.faults, chamber.address)

    @property
    def counts_per_c(self) -> int:
        """Counts per kelvin."""
        return int(10**self.decimals)

    def _make_cells(self) -> dict[int, Cell]:
        return {
            f4.MODEL.number: int16(lambda _: self.model),
            f4.AIR.number: int16(self._air),
            f4.MODE.number: int16(lambda _: self.mode),
            f4.SETPOINT.number: int16(lambda _: self.setpoint, self._set),
            f4.SETPOINT_LOW.number: int16(lambda _: self.min_c * self.counts_per_c),
            f4.SETPOINT_HIGH.number: int16(lambda _: self.max_c * self.counts_per_c),
            f4.DECIMALS.number: int16(lambda _: self.decimals),
            f4.UNITS.number: int16(lambda _: self.units),
            f4.SCALE.number: int16(lambda _: self.scale),
            **items(f4.AIR.number + 1, 1, self.alarm_words),
            f4.CURRENT_PROFILE.number: int16(lambda _: self.profile),
            f4.TERMINATE.number: Cell(lambda _: (0,), self._terminate),
            **items(f4.INPUT_STATE.number, f4.INPUT_STRIDE, self.inputs),
            **items(f4.INPUT_FUNCTION.number, f4.INPUT_SETUP_STRIDE, self.input_functions),
            **items(f4.INPUT_ACTIVE.number, f4.INPUT_SETUP_STRIDE, self.active_states),
            **{f4.EVENT.number + f4.EVENT_STRIDE * n: self._event(n) for n in range(f4.EVENTS)},
            **{number: constant(0) for number in UNUSED_REGISTERS},
        }

    def _air(self, t_s: float) -> float:
        return self.sensor_code if self.sensor_code is not None else self._world.heat.air_c(t_s) * self.counts_per_c

    def _set(self, counts: int, t_s: float) -> bool:
        if not self.min_c <= counts / self.counts_per_c <= self.max_c:
            return False
        self.writes.append(counts)
        if self.on_run_page:
            self.setpoint = counts
            self._control(t_s)
        return True

    def _control(self, t_s: float) -> None:
        """Move the air to the set point, or to that of the room while the event that lets the chamber run is off."""
        runs = self._enabling is None or self.events[self._enabling] == f4.EVENT_ON
        self._world.heat.set(t_s, self.setpoint / self.counts_per_c if runs else AMBIENT_C)

    def switch(self, event: int, t_s: float, *, on: bool) -> None:
        """Switch an event output, from 1, as a person does at the panel."""
        changed, self.events[event - 1] = self.events[event - 1] != on, int(on)
        if changed and event - 1 == self._enabling:
            self._control(t_s)

    def _terminate(self, words: list[int], _t_s: float) -> bool:
        self.mode = f4.MODE_STATIC
        return words == [f4.TERMINATE_PROFILE]

    def _event(self, n: int) -> Cell:
        def put(value: int, t_s: float) -> bool:
            if allowed := value in {0, 1}:
                self.switch(n + 1, t_s, on=value == 1)
            return allowed

        return int16(lambda _: self.events[n], put)
