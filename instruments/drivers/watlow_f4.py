"""Watlow Series F4 over Modbus RTU: signed 16-bit registers with implied decimals.

No register list of this controller is public as a whole. Numbers come from projects that run real chambers
(ChamberConnectLibrary of Espec North America; F4 gateways); what only one of them shows is a setting of the bench file.
"""

from __future__ import annotations

from instruments.bench_config import ChamberSettings
from instruments.clock import Clock
from instruments.drivers.watlow import REPLY_S, Watlow
from instruments.errors import RequestRejected
from instruments.protocols.modbus_registers import Register
from instruments.transport.factory import Ports
from instruments.transport.modbus import Client, Registers

CCL = "ChamberConnectLibrary, watlowf4.py"
FIELD = "seen on real chambers by several gateways"
#: The controller needs this between two requests (ChamberConnectLibrary, modbus.py).
PAUSE_S = 0.03
#: From here down this family returns codes for absent or broken sensors (Watlow communications guide).
LOWEST_COUNT = -31999

MODEL = Register(0, "model", source="pymodbus driver of an F4 chamber")
AIR = Register(100, "air temperature", "int16", "counts", low=LOWEST_COUNT, source=FIELD)
MODE = Register(200, "mode", low=0, high=3, source=CCL)
INPUT_STATE = Register(201, "state of digital input", source=CCL)
SETPOINT = Register(300, "set point", "int16", "counts", low=LOWEST_COUNT, access="rw", source=FIELD)
SETPOINT_LOW = Register(602, "set point low limit", "int16", "counts", access="rw", source=CCL)
SETPOINT_HIGH = Register(603, "set point high limit", "int16", "counts", access="rw", source=CCL)
DECIMALS = Register(606, "decimals of input 1", low=0, high=3, source=CCL)
UNITS = Register(608, "units of input 1", low=0, high=3, source=CCL)
SCALE = Register(901, "temperature scale", source=CCL)
INPUT_FUNCTION = Register(1060, "function of digital input", source=CCL)
INPUT_ACTIVE = Register(1061, "active state of digital input", source=CCL)
TERMINATE = Register(1217, "end of the profile", low=1, high=1, access="w", source=CCL)
EVENT = Register(2000, "event output", low=0, high=1, access="rw", source=CCL)
INPUT_STRIDE, INPUT_SETUP_STRIDE, EVENT_STRIDE = 12, 2, 10

MODEL_F4 = 5270
TEMPERATURE, FAHRENHEIT = 0, 0
PROFILE_RUNS, PROFILE_HELD = 2, 3
WAITS_FOR = 10


class WatlowF4(Watlow):
    """Driver of a chamber on a Watlow F4."""

    def __init__(self, settings: ChamberSettings, ports: Ports, clock: Clock) -> None:
        def link() -> Client:
            return ports.modbus_rtu(
                settings.port or "", device=self.name, baudrate=settings.baudrate, timeout_s=REPLY_S
            )

        registers = Registers(
            self.name, settings.address, clock, link, pause_s=PAUSE_S, write_function=settings.write_function
        )
        super().__init__(settings, registers, clock)
        self._counts_per_c: float | None = None

    def identify(self) -> str:
        """Get model and units; raises WrongInstrument for another model, for Fahrenheit, for an input that is none."""
        get = self._registers.get_int
        if (model := get(MODEL)) != MODEL_F4:
            raise self._wrong(f"the model register holds {model}, an F4's holds {MODEL_F4}")
        if (units := get(UNITS)) != TEMPERATURE:
            raise self._wrong(f"input 1 measures no temperature (its units are {units}, a temperature's are 0)")
        if get(SCALE) == FAHRENHEIT:
            raise self._wrong("the controller works in Fahrenheit, set it to Celsius at its front panel")
        for number in self.settings.alarm_inputs:
            if get(INPUT_FUNCTION.nth(number, INPUT_SETUP_STRIDE)) == WAITS_FOR:
                raise self._wrong(f"digital input {number} is a profile's wait-for input, not an alarm (alarm_inputs)")
        return f"Watlow F4, steps of {self._resolution_c():g} deg C"

    def _scale(self) -> float:
        """Return how many counts one kelvin is: ten to the number of implied decimals."""
        if self._counts_per_c is None:
            self._counts_per_c = 10.0 ** self._registers.get_int(DECIMALS)
        return self._counts_per_c

    def _resolution_c(self) -> float:
        return 1.0 / self._scale()

    def _celsius(self, register: Register) -> float:
        return self._registers.get(register) / self._scale()

    def _controller_limits(self) -> tuple[float, float]:
        return self._celsius(SETPOINT_LOW), self._celsius(SETPOINT_HIGH)

    def _profile_runs(self) -> bool:
        return self._registers.get_int(MODE) in {PROFILE_RUNS, PROFILE_HELD}

    def _end_profile(self) -> None:
        self._registers.put(TERMINATE, 1)

    def _switch_on(self) -> None:
        if self.settings.enable_event is None:
            return
        event = EVENT.nth(self.settings.enable_event, EVENT_STRIDE)
        if self._registers.get_int(event) != 1:
            self._registers.put(event, 1)
            if self._registers.get_int(event) != 1:
                raise RequestRejected(
                    self.name, f"{event} stays off, the chamber cannot be switched on; check enable_event"
                )

    def _write_setpoint(self, temperature_c: float) -> None:
        self._registers.put(SETPOINT, round(temperature_c * self._scale()))

    def _read_setpoint(self) -> float:
        return self._celsius(SETPOINT)

    def _read_air(self) -> float:
        return self._celsius(AIR)

    def _alarms(self) -> tuple[str, ...]:
        """Return the digital inputs that signal; alarm registers of the F4 are not known to anybody who publishes."""
        return tuple(f"digital input {number}" for number in self.settings.alarm_inputs if self._signals(number))

    def _signals(self, number: int) -> bool:
        state = self._registers.get_int(INPUT_STATE.nth(number, INPUT_STRIDE))
        return state == self._registers.get_int(INPUT_ACTIVE.nth(number, INPUT_SETUP_STRIDE))
