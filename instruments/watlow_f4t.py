"""Watlow F4T over Modbus TCP: 32-bit floats in two registers, low word first unless the controller is set otherwise."""

from __future__ import annotations

import math

from instruments.bench import ChamberSettings
from instruments.clock import Clock
from instruments.errors import Garbled
from instruments.modbus import Registers
from instruments.ports import Ports
from instruments.watlow import REPLY_S, Watlow

# data map 1, control loop 1
PART_NUMBER, PART_NUMBER_LENGTH = 16, 15
DEVICE_STATUS, STATUS_OK = 90, 138
ETHERNET_UNITS, CELSIUS = 6730, 15
ALARM_STATE, ALARM_QUIET = 1356, frozenset({88, 61, 12})
ALARMS = 4
CONTROL_MODE, MODE_OFF = 2814, 62
SETPOINT_LOW, SETPOINT_HIGH = 2774, 2776
SETPOINT, AIR = 2782, 2820
RESOLUTION_C = 0.1


class WatlowF4T(Watlow):
    """Driver of a chamber on a Watlow F4T."""

    def __init__(self, settings: ChamberSettings, ports: Ports, clock: Clock) -> None:
        host = settings.host or ""

        def link() -> object:
            return ports.modbus_tcp(host, settings.tcp_port, device="chamber", timeout_s=REPLY_S)

        super().__init__(settings, Registers("chamber", settings.address, clock, link), clock)
        self._alarm_due_s = -math.inf
        self._last_alarms: tuple[str, ...] = ()

    def identify(self) -> str:
        """Get the part number; raises WrongInstrument when the controller is ill or speaks Fahrenheit."""
        letters = self._registers.read(PART_NUMBER, PART_NUMBER_LENGTH, "part number")
        part = "".join(chr(letter) for letter in letters if 32 < letter < 127)
        if not part.startswith("F4T"):
            raise self._wrong(f"part number {part!r} is not an F4T's")
        status = self._registers.read(DEVICE_STATUS, 1, "device status")[0]
        if status != STATUS_OK:
            raise self._wrong(f"device status {status} instead of {STATUS_OK} (ok)")
        if self._registers.read(ETHERNET_UNITS, 1, "units on Ethernet")[0] != CELSIUS:
            raise self._wrong("the controller sends Fahrenheit over Ethernet; set its units to Celsius")
        return f"Watlow {part}"

    def _float(self, register: int, what: str) -> float:
        value = self._registers.read_float(register, what, self.settings.word_order)
        if not math.isfinite(value) or abs(value) > 1000:
            raise Garbled(self.name, f"{what} reads {value:g} deg C; check word_order in the bench file and the sensor")
        return value

    def _controller_limits(self) -> tuple[float, float]:
        return self._float(SETPOINT_LOW, "set point low limit"), self._float(SETPOINT_HIGH, "set point high limit")

    def _resolution_c(self) -> float:
        return RESOLUTION_C

    def _write_setpoint(self, temperature_c: float) -> None:
        self._registers.write_float(SETPOINT, temperature_c, "set point", self.settings.word_order)

    def _read_setpoint(self) -> float:
        return self._float(SETPOINT, "set point")

    def _read_air(self) -> float:
        return self._float(AIR, "air temperature")

    def _alarms(self) -> tuple[str, ...]:
        """Alarm states change slowly: they are asked for once a minute, the air at every poll."""
        now = self._clock.now_s()
        if now >= self._alarm_due_s:
            self._alarm_due_s = now + 60.0
            found = [f"alarm {n + 1}" for n in range(ALARMS) if not self._is_quiet(n)]
            if self._registers.read(CONTROL_MODE, 1, "control mode")[0] == MODE_OFF:
                found.append("control is off")
            self._last_alarms = tuple(found)
        return self._last_alarms

    def _is_quiet(self, number: int) -> bool:
        state = self._registers.read(ALARM_STATE + 100 * number, 1, f"state of alarm {number + 1}")[0]
        return state in ALARM_QUIET
