"""Watlow F4T over Modbus TCP: 32-bit floats in two registers, low word first unless the controller is set otherwise.

Data map 1, control loop 1. Sources: F4T user's manual pp. 222-234; ChamberConnectLibrary, watlowf4t.py.
"""

from __future__ import annotations

import math

from instruments.bench_config import ChamberSettings
from instruments.clock import Clock
from instruments.drivers.watlow import REPLY_S, Watlow
from instruments.errors import RequestRejected
from instruments.protocols.modbus_registers import Register
from instruments.transport.factory import Ports
from instruments.transport.modbus import ILLEGAL_ADDRESS, Client, RefusedRegister, Registers

MANUAL, CCL = "F4T manual pp. 222-234", "ChamberConnectLibrary, watlowf4t.py"
#: No chamber is colder or hotter; a float with its words swapped nearly always is.
COLDEST_C, HOTTEST_C = -200.0, 500.0

PART_NUMBER = Register(16, "part number", source=f"{CCL}; {MANUAL}")
STATUS = Register(90, "device status", source=MANUAL)
ALARM = Register(1356, "state of alarm", source=MANUAL)
CONTROL_MODE = Register(2814, "control mode", source=CCL)
SETPOINT_LOW = Register(2774, "set point minimum", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
SETPOINT_HIGH = Register(2776, "set point maximum", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
SETPOINT = Register(2782, "set point", "float32", "deg C", COLDEST_C, HOTTEST_C, access="rw", source=CCL)
AIR = Register(2820, "air temperature", "float32", "deg C", COLDEST_C, HOTTEST_C, source=CCL)
ETHERNET_UNITS = Register(6730, "units on Ethernet", source=CCL)
PROFILE_ACTION = Register(16566, "profile action", low=148, high=148, access="w", source=CCL)
PROFILE_STATE = Register(16568, "profile state", source=CCL)

PART_LETTERS = 15
STATUS_OK, CELSIUS = 138, 15
ALARMS, ALARM_STRIDE = 4, 100
ALARM_QUIET = frozenset({88, 61, 12})  #: startup, none, blocked
MODE_AUTO, MODES = 10, {10: "auto", 54: "manual", 62: "off"}
PROFILE_ACTIVE = frozenset({149, 146})  #: running, paused
TERMINATE = 148
RESOLUTION_C = 0.1
ALARMS_EVERY_S = 30.0  #: five more requests; a chamber does not burn in half a minute, and the air is always looked at


class WatlowF4T(Watlow):
    """Driver of a chamber on a Watlow F4T."""

    def __init__(self, settings: ChamberSettings, ports: Ports, clock: Clock) -> None:
        def link() -> Client:
            return ports.modbus_tcp(settings.host or "", settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        registers = Registers(self.name, settings.address, clock, link, word_order=settings.word_order)
        super().__init__(settings, registers, clock)
        self._alarms_due_s = -math.inf
        self._last_alarms: tuple[str, ...] = ()

    def identify(self) -> str:
        """Get the part number; raises WrongInstrument when the controller is another, is ill or speaks Fahrenheit."""
        letters = self._registers.words(PART_NUMBER, PART_LETTERS)
        part = "".join(chr(letter) for letter in letters if 32 < letter < 127)
        if not part.startswith("F4T"):
            raise self._wrong(f"part number {part!r} is not an F4T's")
        if (status := self._registers.get_int(STATUS)) != STATUS_OK:
            raise self._wrong(f"the device status is {status} instead of {STATUS_OK} (ok)")
        if (units := self._registers.get_int(ETHERNET_UNITS)) != CELSIUS:
            raise self._wrong(f"units on Ethernet are {units} instead of {CELSIUS} (Celsius), set them at its panel")
        return f"Watlow {part}"

    def _controller_limits(self) -> tuple[float, float]:
        return self._registers.get(SETPOINT_LOW), self._registers.get(SETPOINT_HIGH)

    def _resolution_c(self) -> float:
        return RESOLUTION_C

    def _profile_runs(self) -> bool:
        try:
            return self._registers.get_int(PROFILE_STATE) in PROFILE_ACTIVE
        except RefusedRegister as refused:
            if refused.code != ILLEGAL_ADDRESS:
                raise
            return False  # profiles are an option of the part number

    def _end_profile(self) -> None:
        self._registers.put(PROFILE_ACTION, TERMINATE)

    def _switch_on(self) -> None:
        if (mode := self._registers.get_int(CONTROL_MODE)) != MODE_AUTO:
            raise RequestRejected(
                self.name, f"control loop 1 is in mode {MODES.get(mode, mode)}, not auto; switch it on at its panel"
            )

    def _write_setpoint(self, temperature_c: float) -> None:
        self._registers.put(SETPOINT, temperature_c)

    def _read_setpoint(self) -> float:
        return round(self._registers.get(SETPOINT), 4)  # a float32 holds 85.1 as 85.0999985

    def _read_air(self) -> float:
        return self._registers.get(AIR)

    def _alarms(self) -> tuple[str, ...]:
        if self._clock.now_s() >= self._alarms_due_s:
            self._last_alarms = self._ask_for_alarms()
            self._alarms_due_s = self._clock.now_s() + ALARMS_EVERY_S
        return self._last_alarms

    def _ask_for_alarms(self) -> tuple[str, ...]:
        found = [f"alarm {number}" for number in range(1, ALARMS + 1) if not self._is_quiet(number)]
        if self._registers.get_int(CONTROL_MODE) != MODE_AUTO:
            found.append("control is not in auto")
        return tuple(found)

    def _is_quiet(self, number: int) -> bool:
        return self._registers.get_int(ALARM.nth(number, ALARM_STRIDE)) in ALARM_QUIET
