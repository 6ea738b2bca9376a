"""Chamber controller Watlow F4T over Modbus TCP: control loop 1 or cascade 1, 32-bit floats in two registers."""

from __future__ import annotations

import math

from instruments.clock import Clock
from instruments.drivers import probes
from instruments.drivers.chambers.watlow import REPLY_S, Watlow
from instruments.drivers.driver import ChamberDriver
from instruments.errors import MalformedReply
from instruments.protocols import watlow_f4t_registers as f4t
from instruments.protocols.modbus_codes import DEVICE_FAILURE, ILLEGAL_ADDRESS
from instruments.protocols.modbus_registers import Register
from instruments.protocols.watlow_settings import WatlowSettings
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import Client, RefusedRegister

#: Period of alarm requests, s: up to 30 more requests per poll otherwise; the air temperature is read at every poll.
ALARMS_EVERY_S = 30.0


class WatlowF4T(Watlow):
    """Driver of a chamber on a Watlow F4T. What it has besides control loop 1 follows from its part number."""

    switches_on = False

    def __init__(self, settings: WatlowSettings, ports: Ports, clock: Clock) -> None:
        def link() -> Client:
            return ports.modbus_tcp(settings.host or "", settings.tcp_port, device=self.name, timeout_s=REPLY_S)

        registers = Registers(self.name, settings.address, clock, link, word_order=settings.word_order)
        super().__init__(settings, registers, clock)
        self._alarms_due_s = -math.inf
        self._last_alarms: tuple[str, ...] = ()
        self._known_part: str | None = None
        self._limit_modules: tuple[int, ...] | None = None

    def identify(self) -> str:
        """Get the part number.

        Raises WrongInstrument for another controller, a device status other than ok, and units other than Celsius,
        MalformedReply for floats in another word order; also what a register read raises.
        """
        self._known_part = None
        part = self._part_number()
        if not part.startswith("F4T"):
            raise self._wrong(
                f"part number {part!r} is not that of an F4T; check the address, or the driver in the bench file"
            )
        if (status := self._registers.get_int(f4t.STATUS)) != f4t.STATUS_OK:
            raise self._wrong(
                f"the device status is {status} instead of {f4t.STATUS_OK} (ok); read the error "
                "at the panel of the controller"
            )
        if (units := self._registers.get_int(f4t.ETHERNET_UNITS)) != f4t.UNITS_CELSIUS:
            raise self._wrong(
                f"the units on Ethernet are {units} instead of {f4t.UNITS_CELSIUS} (Celsius); set them at the "
                "panel of the controller"
            )
        self._controller_limits()
        return f"Watlow {part}"

    def _part_number(self) -> str:
        if self._known_part is None:
            letters = self._registers.words(f4t.PART_NUMBER, f4t.PART_NUMBER_LETTERS)
            self._known_part = "".join(chr(letter) for letter in letters if 32 < letter < 127)
        return self._known_part

    def _loop(self) -> f4t.ControlLoop:
        stated_cascade = self.settings.cascade
        cascade = f4t.has_cascade(self._part_number()) if stated_cascade is None else stated_cascade
        return f4t.CASCADE if cascade else f4t.LOOP

    def _controller_limits(self) -> tuple[float, float]:
        loop = self._loop()
        low, high = self._registers.get(loop.low), self._registers.get(loop.high)
        if not low < high:
            other = "big" if self.settings.word_order == "little" else "little"
            raise MalformedReply(
                self.name,
                f"its set-point limits were read as {low:g} and {high:g} deg C, but the lower limit must be below the "
                f"upper one; if its panel shows other limits, set word_order = '{other}' in the bench file, otherwise "
                "correct the limits at its panel",
            )
        return low, high

    def _resolution_c(self) -> float:
        return f4t.RESOLUTION_C

    def _profile_runs(self) -> bool:
        # profiles are an option of the part number
        return self._read_if_there(f4t.PROFILE_STATE) in f4t.PROFILE_ACTIVE

    def _end_profile(self) -> None:
        self._registers.put(f4t.PROFILE_ACTION, f4t.PROFILE_TERMINATE)

    def _stopped(self) -> str:
        loop = self._loop()
        if (mode := self._registers.get_int(loop.mode)) != f4t.MODE_AUTO:
            loop_name = "cascade loop 1" if loop is f4t.CASCADE else "control loop 1"
            return f"{loop_name} is in mode {f4t.MODES.get(mode, mode)}, not auto"
        if self.settings.run_output is None:
            return ""
        module, output = self.settings.run_output
        register = f4t.OUTPUT.nth(module, f4t.MODULE_STRIDE).nth(output, f4t.OUTPUT_STRIDE)
        if self._registers.get_int(register) == f4t.ON:
            return ""
        return f"the chamber does not run (output {output} of module {module} is off)"

    def _start(self) -> None:
        """Do nothing: the mode and the run output are switched at the panel."""

    def _write_setpoint(self, temperature_c: float) -> None:
        self._registers.put(self._loop().setpoint, temperature_c)

    def _read_setpoint(self) -> float:
        return round(self._registers.get(self._loop().setpoint), 4)  # a float32 holds 85.1 as 85.0999985

    def _read_air(self) -> float:
        return self._registers.get(self._loop().air)

    def _alarms(self) -> tuple[str, ...]:
        if self._clock.now_s() >= self._alarms_due_s:
            self._last_alarms = self._read_alarms()
            self._alarms_due_s = self._clock.now_s() + ALARMS_EVERY_S
        return self._last_alarms

    def _read_alarms(self) -> tuple[str, ...]:
        alarms = f4t.alarms_of(self._part_number())
        active_alarms = [f"alarm {number}" for number in range(1, alarms + 1) if not self._is_quiet(number)]
        active_alarms += [
            f"limit module {number}" for number in self._present_limit_modules() if self._has_tripped(number)
        ]
        return tuple(active_alarms)

    def _is_quiet(self, number: int) -> bool:
        return self._registers.get_int(f4t.ALARM.nth(number, f4t.ALARM_STRIDE)) in f4t.ALARM_QUIET

    def _present_limit_modules(self) -> tuple[int, ...]:
        """Return the slots with a limit module; the controller is asked once."""
        if self._limit_modules is None:
            slots = range(1, f4t.LIMIT_MODULES + 1)
            states = {n: self._read_if_there(f4t.LIMIT_STATE.nth(n, f4t.LIMIT_STRIDE)) for n in slots}
            self._limit_modules = tuple(n for n, state in states.items() if state is not None)
        return self._limit_modules

    def _has_tripped(self, module: int) -> bool:
        state, status, error = (
            self._registers.get_int(register.nth(module, f4t.LIMIT_STRIDE))
            for register in (f4t.LIMIT_STATE, f4t.LIMIT_STATUS, f4t.LIMIT_ERROR)
        )
        return state == f4t.ERROR or status == f4t.FAIL or error != f4t.NONE

    def _read_if_there(self, register: Register) -> int | None:
        """Return the value of a register; None where the controller lacks it."""
        try:
            return self._registers.get_int(register)
        except RefusedRegister as refused:
            if refused.code not in {ILLEGAL_ADDRESS, DEVICE_FAILURE}:
                raise
            return None


DRIVER = ChamberDriver(WatlowSettings, WatlowF4T, probe=probes.F4T)
