"""Chamber controller Watlow F4T over Modbus TCP: control loop 1, 32-bit floats in two registers."""

from __future__ import annotations

import math

from instruments.clock import Clock
from instruments.drivers.driver import ChamberDriver
from instruments.drivers.watlow import REPLY_S, Watlow
from instruments.errors import RequestRejected
from instruments.protocols import watlow_f4t_registers as f4t
from instruments.protocols.modbus_codes import ILLEGAL_ADDRESS
from instruments.protocols.watlow_settings import WatlowSettings
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import Client, RefusedRegister

#: Period of alarm requests, s: five more requests per poll otherwise; the air temperature is read at every poll.
ALARMS_EVERY_S = 30.0


class WatlowF4T(Watlow):
    """Driver of a chamber on a Watlow F4T."""

    def __init__(self, settings: WatlowSettings, ports: Ports, clock: Clock) -> None:
        def link() -> Client:
            return ports.modbus_tcp(settings.host or "", settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        registers = Registers(self.name, settings.address, clock, link, word_order=settings.word_order)
        super().__init__(settings, registers, clock)
        self._alarms_due_s = -math.inf
        self._last_alarms: tuple[str, ...] = ()

    def identify(self) -> str:
        """Get the part number.

        Raises WrongInstrument for another controller, a device status other than ok, and units other than Celsius; also
        what a register read raises.
        """
        letters = self._registers.words(f4t.PART_NUMBER, f4t.PART_NUMBER_LETTERS)
        part = "".join(chr(letter) for letter in letters if 32 < letter < 127)
        if not part.startswith("F4T"):
            raise self._wrong(f"part number {part!r} is not an F4T's")
        if (status := self._registers.get_int(f4t.STATUS)) != f4t.STATUS_OK:
            raise self._wrong(f"the device status is {status} instead of {f4t.STATUS_OK} (ok)")
        if (units := self._registers.get_int(f4t.ETHERNET_UNITS)) != f4t.UNITS_CELSIUS:
            raise self._wrong(
                f"units on Ethernet are {units} instead of {f4t.UNITS_CELSIUS} (Celsius), set them at its panel"
            )
        return f"Watlow {part}"

    def _controller_limits(self) -> tuple[float, float]:
        return self._registers.get(f4t.SETPOINT_LOW), self._registers.get(f4t.SETPOINT_HIGH)

    def _resolution_c(self) -> float:
        return f4t.RESOLUTION_C

    def _profile_runs(self) -> bool:
        try:
            return self._registers.get_int(f4t.PROFILE_STATE) in f4t.PROFILE_ACTIVE
        except RefusedRegister as refused:
            if refused.code != ILLEGAL_ADDRESS:
                raise
            return False  # profiles are an option of the part number

    def _end_profile(self) -> None:
        self._registers.put(f4t.PROFILE_ACTION, f4t.PROFILE_TERMINATE)

    def _switch_on(self) -> None:
        if (mode := self._registers.get_int(f4t.CONTROL_MODE)) != f4t.MODE_AUTO:
            raise RequestRejected(
                self.name, f"control loop 1 is in mode {f4t.MODES.get(mode, mode)}, not auto; switch it on at its panel"
            )

    def _write_setpoint(self, temperature_c: float) -> None:
        self._registers.put(f4t.SETPOINT, temperature_c)

    def _read_setpoint(self) -> float:
        return round(self._registers.get(f4t.SETPOINT), 4)  # a float32 holds 85.1 as 85.0999985

    def _read_air(self) -> float:
        return self._registers.get(f4t.AIR)

    def _alarms(self) -> tuple[str, ...]:
        if self._clock.now_s() >= self._alarms_due_s:
            self._last_alarms = self._read_alarms()
            self._alarms_due_s = self._clock.now_s() + ALARMS_EVERY_S
        return self._last_alarms

    def _read_alarms(self) -> tuple[str, ...]:
        found = [f"alarm {number}" for number in range(1, f4t.ALARMS + 1) if not self._is_quiet(number)]
        if self._registers.get_int(f4t.CONTROL_MODE) != f4t.MODE_AUTO:
            found.append("control is not in auto")
        return tuple(found)

    def _is_quiet(self, number: int) -> bool:
        return self._registers.get_int(f4t.ALARM.nth(number, f4t.ALARM_STRIDE)) in f4t.ALARM_QUIET


DRIVER = ChamberDriver(WatlowSettings, WatlowF4T)
