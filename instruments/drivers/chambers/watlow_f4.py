"""Chamber controller Watlow Series F4 over Modbus RTU: signed 16-bit registers with implied decimals."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers import probes
from instruments.drivers.chambers.watlow import REPLY_S, Watlow
from instruments.drivers.driver import ChamberDriver
from instruments.errors import RequestRejected
from instruments.protocols import watlow_f4_registers as f4
from instruments.protocols.modbus_codes import ILLEGAL_ADDRESS
from instruments.protocols.modbus_registers import Register
from instruments.protocols.watlow_settings import WatlowSettings
from instruments.transport.factory import Ports
from instruments.transport.modbus import Registers
from instruments.transport.modbus_link import Client, RefusedRegister
from instruments.transport.serial_stream import line_of


class WatlowF4(Watlow):
    """Driver of a chamber on a Watlow F4."""

    def __init__(self, settings: WatlowSettings, ports: Ports, clock: Clock) -> None:
        def link() -> Client:
            return ports.modbus_rtu(
                settings.port or "", device=self.name, baudrate=settings.baudrate, timeout_s=REPLY_S,
                line=line_of(settings.line),
            )  # fmt: skip

        registers = Registers(
            self.name, settings.address, clock, link, pause_s=f4.PAUSE_S, write_function=settings.write_function
        )
        super().__init__(settings, registers, clock)
        self._counts_per_c: float | None = None
        self._alarm_words: list[int] = []

    def identify(self) -> str:
        """Get model and resolution.

        Raises WrongInstrument for another model, for Fahrenheit, for input 1 without temperature units, and for an
        alarm input that a profile waits for; also what a register read raises.
        """
        get = self._registers.get_int
        if (model := get(f4.MODEL)) != f4.MODEL_F4:
            raise self._wrong(
                f"the model register reads {model} instead of {f4.MODEL_F4} (F4); check the "
                "address, or the driver in the bench file"
            )
        if (units := get(f4.UNITS)) != f4.UNITS_TEMPERATURE:
            raise self._wrong(
                f"input 1 does not measure a temperature (its units register reads {units} "
                "instead of 0); set the input to temperature at the front panel"
            )
        if get(f4.SCALE) == f4.SCALE_FAHRENHEIT:
            raise self._wrong("the controller works in degrees Fahrenheit; set it to Celsius at its front panel")
        for number in self.settings.alarm_inputs:
            if get(f4.INPUT_FUNCTION.nth(number, f4.INPUT_SETUP_STRIDE)) == f4.FUNCTION_WAIT_FOR:
                raise self._wrong(
                    f"the controller uses digital input {number} as the wait-for input of a "
                    "profile, not as an alarm; remove the input from alarm_inputs"
                )
        return "; ".join([f"Watlow F4, steps of {self._resolution_c():g} deg C", *self._registers.remarks])

    def _read_scale(self) -> float:
        """Return the counts per kelvin: ten to the number of implied decimals. Asks the controller once."""
        if self._counts_per_c is None:
            self._counts_per_c = 10.0 ** self._registers.get_int(f4.DECIMALS)
        return self._counts_per_c

    def _resolution_c(self) -> float:
        return 1.0 / self._read_scale()

    def _celsius(self, register: Register) -> float:
        return self._registers.get(register) / self._read_scale()

    def _controller_limits(self) -> tuple[float, float]:
        return self._celsius(f4.SETPOINT_LOW), self._celsius(f4.SETPOINT_HIGH)

    def _mode(self) -> int:
        return int(self._registers.get_block(f4.MODE, f4.MODE_COUNTS)[0])

    def _profile_runs(self) -> bool:
        mode = self._mode()
        return mode in {f4.MODE_PROFILE_RUNNING, f4.MODE_PROFILE_HELD} and not self._is_manual(mode)

    def _hindrance(self) -> str:
        if self._is_manual(self._mode()):
            return (
                "the controller is in manual mode, so a set point would have no effect; set the controller to "
                "auto at its panel"
            )
        return super()._hindrance()

    def _is_manual(self, mode: int) -> bool:
        """Return whether a mode is the manual one of an F4P, which has no profile that could run."""
        if mode != f4.MODE_MANUAL_F4P:
            return False
        try:
            return self._registers.get_int(f4.CURRENT_PROFILE) not in f4.PROFILES
        except RefusedRegister as refused:
            if refused.code != ILLEGAL_ADDRESS:
                raise
            return True

    def _end_profile(self) -> None:
        self._registers.put(f4.TERMINATE, f4.TERMINATE_PROFILE)

    def _enabling(self) -> Register | None:
        number = self.settings.enable_event
        return None if number is None else f4.EVENT.nth(number, f4.EVENT_STRIDE)

    def _stopped(self) -> str:
        event = self._enabling()
        return "" if event is None or self._registers.get_int(event) == f4.EVENT_ON else f"{event} is off"

    def _start(self) -> None:
        if (event := self._enabling()) is None:
            return
        self._registers.put(event, f4.EVENT_ON)
        if self._stopped():
            raise RequestRejected(
                self.name,
                f"{event} stays off, so the chamber cannot be switched on; check enable_event in the bench file",
            )

    def _write_setpoint(self, temperature_c: float) -> None:
        self._registers.put(f4.SETPOINT, round(temperature_c * self._read_scale()))

    def _read_setpoint(self) -> float:
        return self._celsius(f4.SETPOINT)

    def _read_air(self) -> float:
        counts, self._alarm_words = self._registers.get_block(f4.AIR, f4.AIR_COUNTS)
        return counts / self._read_scale()

    def _alarms(self) -> tuple[str, ...]:
        """Return the active alarm inputs, and the alarms and input error that came with the air temperature."""
        alarms = [f"digital input {number}" for number in self.settings.alarm_inputs if self._is_active(number)]
        words = dict(enumerate(self._alarm_words)) if self.settings.alarm_registers else {}
        if (code := words.get(f4.INPUT_ERROR, 0)) in f4.INPUT_ERRORS:
            alarms.append(f"error {code} of input 1")
        for alarm, offset in f4.ALARM_OFFSETS.items():
            if state := f4.ALARM_STATES.get(words.get(offset, 0)):
                alarms.append(f"alarm {alarm} {state}")
        return tuple(alarms)

    def _is_active(self, number: int) -> bool:
        state = self._registers.get_int(f4.INPUT_STATE.nth(number, f4.INPUT_STRIDE))
        return state == self._registers.get_int(f4.INPUT_ACTIVE.nth(number, f4.INPUT_SETUP_STRIDE))


DRIVER = ChamberDriver(WatlowSettings, WatlowF4, probe=probes.F4)
