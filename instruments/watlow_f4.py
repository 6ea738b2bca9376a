"""Watlow Series F4 over Modbus RTU: signed 16-bit registers with implied decimals."""

from __future__ import annotations

from typing import Literal

from instruments.bench import ChamberSettings
from instruments.clock import Clock
from instruments.errors import Garbled, Refused
from instruments.modbus import PAUSE_S, Registers
from instruments.ports import Ports
from instruments.watlow import REPLY_S, Watlow

# register numbers as they go on the wire
MODEL, MODEL_F4 = 0, 5270
AIR = 100
MODE, MODE_STATIC = 200, (0, 1)
INPUT_STATE, INPUT_ACTIVE = 201, 1061
SETPOINT, SETPOINT_LOW, SETPOINT_HIGH = 300, 602, 603
DECIMALS, UNITS, UNITS_TEMPERATURE = 606, 608, 0
SCALE, SCALE_FAHRENHEIT = 901, 0
TERMINATE_PROFILE = 1217
EVENT = 2000
#: Values that this family returns in place of a measurement.
NO_MEASUREMENT = -32000


class WatlowF4(Watlow):
    """Driver of a chamber on a Watlow F4."""

    def __init__(self, settings: ChamberSettings, ports: Ports, clock: Clock) -> None:
        url = settings.port or ""

        def link() -> object:
            return ports.modbus_rtu(url, device="chamber", baudrate=settings.baudrate, timeout_s=REPLY_S)

        super().__init__(settings, Registers("chamber", settings.address, clock, link), clock)
        self._per_c: float | None = None
        self._function: Literal[6, 16] = settings.write_function

    def identify(self) -> str:
        """Get model and units; raises WrongInstrument for another model or for Fahrenheit."""
        model = self._read(MODEL, "model")
        if model != MODEL_F4:
            raise self._wrong(f"model register holds {model}, an F4 holds {MODEL_F4}")
        if self._read(UNITS, "input units") != UNITS_TEMPERATURE:
            raise self._wrong("input 1 does not measure a temperature")
        if self._read(SCALE, "temperature scale") == SCALE_FAHRENHEIT:
            raise self._wrong("the controller works in Fahrenheit; set it to Celsius at its front panel")
        return f"Watlow F4, {self._resolution_c():g} deg C"

    def _read(self, register: int, what: str) -> int:
        self._clock.sleep(PAUSE_S)
        return self._registers.read_int16(register, what)

    def _scale(self) -> float:
        """Return how many counts one kelvin is: 10 to the number of implied decimals."""
        if self._per_c is None:
            decimals = self._read(DECIMALS, "decimals")
            if not 0 <= decimals <= 3:
                raise Garbled(self.name, f"decimals register {DECIMALS} holds {decimals}, expected 0 to 3")
            self._per_c = float(10**decimals)
        return self._per_c

    def _resolution_c(self) -> float:
        return 1.0 / self._scale()

    def _controller_limits(self) -> tuple[float, float]:
        low, high = self._read(SETPOINT_LOW, "set point low limit"), self._read(SETPOINT_HIGH, "set point high limit")
        return low / self._scale(), high / self._scale()

    def _write_setpoint(self, temperature_c: float) -> None:
        """Write a static set point; a profile that runs would not heed it, so it is ended first."""
        if self._read(MODE, "mode") not in MODE_STATIC:
            self._write(TERMINATE_PROFILE, 1, "terminate the running profile")
        if self.settings.enable_event is not None:
            self._write(EVENT + 10 * (self.settings.enable_event - 1), 1, "switch the chamber on")
        self._write(SETPOINT, round(temperature_c * self._scale()), "set point")

    def _write(self, register: int, value: int, what: str) -> None:
        """Write by the function of the bench file; where the controller does not know it, by the other."""
        self._clock.sleep(PAUSE_S)
        try:
            self._registers.write(register, value, what, function=self._function)
        except Refused as refused:
            if "exception 1," not in str(refused):
                raise
            self._function = 16 if self._function == 6 else 6
            self._registers.write(register, value, what, function=self._function)

    def _read_setpoint(self) -> float:
        return self._read(SETPOINT, "set point") / self._scale()

    def _read_air(self) -> float:
        raw = self._read(AIR, "air temperature")
        if raw <= NO_MEASUREMENT:
            raise Garbled(self.name, f"air temperature register holds {raw}: no measurement; check the sensor")
        return raw / self._scale()

    def _alarms(self) -> tuple[str, ...]:
        """Return the digital inputs named in the bench file that are active; no alarm register of an F4 is known."""
        active = []
        for number in self.settings.alarm_inputs:
            state = self._read(INPUT_STATE + 12 * (number - 1), f"digital input {number}")
            if state == self._read(INPUT_ACTIVE + 2 * (number - 1), f"active state of input {number}"):
                active.append(f"digital input {number}")
        return tuple(active)
