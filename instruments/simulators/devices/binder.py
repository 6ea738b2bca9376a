"""Simulated Binder MK 53 and MK 56 on the world's chamber, over Modbus RTU."""

from __future__ import annotations

from instruments.bench_config import part_of
from instruments.protocols import binder_registers as binder
from instruments.simulators.chamber_state import ChamberState
from instruments.simulators.links.modbus_device import Cell, ModbusDevice, float32, int16
from instruments.simulators.setup import InstrumentSetup


class SimulatedBinder(ModbusDevice):
    """In its manual mode at the start; `mode` is what a person chooses at the panel."""

    def __init__(self, setup: InstrumentSetup) -> None:
        settings = part_of(setup.instrument("chamber"), binder.BinderSettings)
        self.chamber = ChamberState(setup)
        self.chamber.runs = True
        self.mode = binder.MANUAL
        where, order = binder.MAPS[settings.controller], settings.word_order
        cells: dict[int, Cell] = {
            where.air.number: float32(order, self.chamber.air_c),
            where.setpoint.number: float32(order, lambda _: self.chamber.setpoint_c),
        }
        for register in where.write:
            cells[register.number] = float32(order, lambda _: self.chamber.setpoint_c, self.chamber.set)
        if where.mode is not None:
            cells[where.mode.number] = int16(lambda _: self.mode)
        super().__init__("rtu", cells, setup.faults, settings.address)
