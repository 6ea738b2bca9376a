"""A simulated Watlow F4T on the world's chamber, over Modbus TCP."""

from __future__ import annotations

from functools import partial

from instruments.bench_config import part_of
from instruments.protocols import watlow_f4t_registers as f4t
from instruments.protocols.modbus_registers import WordOrder
from instruments.protocols.watlow_settings import WatlowSettings
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, constant, float32, int16, items
from instruments.simulators.setup import InstrumentSetup

AMBIENT_C = 25.0
LIMIT_SLOT = 5
#: Without profiles, with 6 alarms and one control loop; `[simulation] chamber = { part_number = ... }` says otherwise.
PART_NUMBER = "F4T1A1A1A1A1A1A"
#: Registers that exist on the controller and that no driver reads.
CONTROL_MODE_COPY, SETPOINT_COPY, UNITS_COPY = 2730, 2810, 14080


class SimulatedF4T(ModbusDevice):
    """Low word first unless the bench file says otherwise; the settings of its front panel are attributes."""

    def __init__(self, setup: InstrumentSetup) -> None:
        chamber = part_of(setup.instrument("chamber"), WatlowSettings)
        self._world = setup.world
        self._order: WordOrder = chamber.word_order
        part = str(setup.world.settings.chamber.get("part_number", PART_NUMBER))
        self.part_number = [ord(letter) for letter in part]
        cascade = chamber.cascade
        self._loop = f4t.CASCADE if (f4t.has_cascade(part) if cascade is None else cascade) else f4t.LOOP
        self.status = f4t.STATUS_OK
        self.units = f4t.UNITS_CELSIUS  #: 30: Fahrenheit
        self.control_mode = f4t.MODE_AUTO
        self.profile_state = f4t.PROFILE_NOT_STARTED
        self.alarms = [f4t.ALARM_NONE] * f4t.alarms_of(part)
        self.limit_module = [f4t.STATUS_OK, f4t.STATUS_OK, f4t.NONE]  #: state, status and error of the one in slot 5
        self.output = f4t.ON  #: output 1 of module 1
        self.setpoint_c = AMBIENT_C
        self.min_c, self.max_c = chamber.min_c, chamber.max_c
        self.writes: list[float] = []  #: every written set point: each one wears the EEPROM
        super().__init__("tcp", self._make_cells(), setup.faults, chamber.address)

    def _make_cells(self) -> dict[int, Cell]:
        order = self._order
        return {
            **items(f4t.PART_NUMBER.number, 1, self.part_number),
            f4t.STATUS.number: int16(lambda _: self.status),
            f4t.ETHERNET_UNITS.number: int16(lambda _: self.units),
            UNITS_COPY: int16(lambda _: self.units),
            CONTROL_MODE_COPY: constant(f4t.MODE_AUTO),
            self._loop.mode.number: int16(lambda _: self.control_mode),
            f4t.PROFILE_ACTION.number: Cell(lambda _: (0,), self._profile_action),
            f4t.PROFILE_STATE.number: int16(lambda _: self.profile_state),
            **items(f4t.ALARM.number, f4t.ALARM_STRIDE, self.alarms),
            **{
                register.nth(LIMIT_SLOT, f4t.LIMIT_STRIDE).number: int16(partial(self._limit, n))
                for n, register in enumerate((f4t.LIMIT_STATE, f4t.LIMIT_STATUS, f4t.LIMIT_ERROR))
            },
            f4t.OUTPUT.number: int16(lambda _: self.output),
            self._loop.low.number: float32(order, lambda _: self.min_c),
            self._loop.high.number: float32(order, lambda _: self.max_c),
            self._loop.setpoint.number: float32(order, lambda _: self.setpoint_c, self._set),
            SETPOINT_COPY: float32(order, lambda _: self.setpoint_c),
            self._loop.air.number: float32(order, self._world.heat.air_c),
        }

    def switch(self, t_s: float, *, on: bool) -> None:
        """Switch control on or off as a person does at the panel: its mode, the output, and the air."""
        self.control_mode, self.output = (f4t.MODE_AUTO, f4t.ON) if on else (f4t.MODE_OFF, f4t.OFF)
        self._world.heat.set(t_s, self.setpoint_c if on else AMBIENT_C)

    def _limit(self, part: int, _t_s: float) -> int:
        return self.limit_module[part]

    def _set(self, temperature_c: float, t_s: float) -> bool:
        if not self.min_c <= temperature_c <= self.max_c:
            return False
        self.writes.append(temperature_c)
        self.setpoint_c = temperature_c
        self._world.heat.set(t_s, temperature_c)
        return True

    def _profile_action(self, words: list[int], _t_s: float) -> bool:
        self.profile_state = f4t.PROFILE_NOT_STARTED
        return words == [f4t.PROFILE_TERMINATE]
