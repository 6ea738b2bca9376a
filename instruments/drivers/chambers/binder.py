"""Chamber controllers Binder MK 53 and MK 56 over Modbus RTU, on a serial port or through an adapter on the network."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.chambers.setpoint_chamber import SetpointChamber
from instruments.drivers.driver import ChamberDriver, Trial
from instruments.errors import RequestRejected
from instruments.protocols import binder_registers as binder
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import Client

REPLY_S = 1.0


class Binder(SetpointChamber):
    """Driver of a chamber on a Binder controller. Which set point counts is chosen at the panel: manual or basic."""

    switches_on = False

    def __init__(self, settings: binder.BinderSettings, ports: Ports, clock: Clock) -> None:
        def link() -> Client:
            return ports.modbus_rtu(
                settings.address_url, device=self.name, baudrate=settings.baudrate, timeout_s=REPLY_S
            )

        self._registers = Registers(self.name, settings.address, clock, link, word_order=settings.word_order)
        self._map = binder.MAPS[settings.controller]
        self._model = settings.controller.upper()
        super().__init__(settings, self._registers, clock)

    def identify(self) -> str:
        """Get the model of the bench file, after air and set point were read.

        The controller has no register of its own name. Raises MalformedReply for values that are no temperatures, and
        what a register read raises.
        """
        self._read_air()
        self._read_setpoint()
        return "; ".join([f"Binder {self._model} (by the bench file)", *self._registers.remarks])

    def _controller_limits(self) -> tuple[float, float]:
        return -float("inf"), float("inf")  # no public source says where they are

    def _resolution_c(self) -> float:
        return binder.RESOLUTION_C

    def _write_setpoint(self, temperature_c: float) -> None:
        for register in self._map.write:
            self._registers.put(register, temperature_c)

    def _read_setpoint(self) -> float:
        return round(self._registers.get(self._map.setpoint), 4)  # a float32 holds 85.1 as 85.0999985

    def _read_air(self) -> float:
        return self._registers.get(self._map.air)

    def _alarms(self) -> tuple[str, ...]:
        return ()  # no public source says where they are

    def _mode(self) -> int | None:
        return None if self._map.mode is None else self._registers.get_int(self._map.mode)

    def _stopped(self) -> str:
        mode = self._mode()
        if mode is None or mode & (binder.BASIC | binder.MANUAL):
            return ""
        return "the controller is idle (mode neither manual nor basic)"

    def _profile_runs(self) -> bool:
        mode = self._mode()
        return mode is not None and bool(mode & binder.AUTOMATIC)

    def _end_profile(self) -> None:
        raise RequestRejected(
            self.name, "a program is running, and labctl cannot end it; end it at the panel of the chamber"
        )

    def _start(self) -> None:
        """Do nothing: the mode is chosen at the panel."""


DRIVER = ChamberDriver(binder.BinderSettings, Binder, Trial(section={"port": "sim://binder", "controller": "mk53"}))
