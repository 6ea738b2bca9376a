"""Chambers of PyMeasure and MSL-Equipment."""

from __future__ import annotations

from instruments.clock import Clock
from instruments.drivers.chambers.setpoint_chamber import SetpointChamber
from instruments.drivers.driver import ChamberDriver, Trial
from instruments.drivers.library_instrument import LibraryInstrument
from instruments.drivers.serial_numbers import refuse_other_serial
from instruments.errors import RequestRejected
from instruments.protocols.library_settings import LibraryChamberSettings
from instruments.transport.factory import Ports


class LibraryChamber(SetpointChamber):
    """Driver of a chamber that another library drives. Limits are those of the bench file, and the library's own."""

    def __init__(self, settings: LibraryChamberSettings, ports: Ports, clock: Clock) -> None:
        self._instrument = LibraryInstrument(self.name, settings, ports, clock)
        super().__init__(settings, self._instrument, clock)
        self._names = settings
        self.switches_on = bool(settings.start)

    def identify(self) -> str:
        """Get what the instrument says of itself, after its air temperature was read.

        Raises WrongInstrument for another serial number, InstrumentError.
        """
        identity = self._instrument.identity()
        refuse_other_serial(self.name, identity, self._names.serial, holds_serial=bool(self._names.identity))
        self._read_air()
        return f"{self._names.instrument} of {self._names.library} {identity}".strip()

    def make_safe(self) -> float:
        """Control the chamber to its safe set point, and off where the bench file says so; returns the value read back.

        Raises as `set_temperature_c` does.
        """
        report = super().make_safe()
        if self._names.safe_state == "off":
            self._instrument.call(self._names.stop)
            self._has_controlled = False
        return report

    def _controller_limits(self) -> tuple[float, float]:
        return -float("inf"), float("inf")  # the library refuses what is beyond its own

    def _resolution_c(self) -> float:
        return self._names.resolution_c

    def _write_setpoint(self, temperature_c: float) -> None:
        self._instrument.set(self._names.setpoint, temperature_c)
        if self._has_controlled and self._names.start:
            self._instrument.call(self._names.start)  # some take a set point over only then

    def _read_setpoint(self) -> float:
        return round(self._instrument.number(self._names.setpoint), 4)

    def _read_air(self) -> float:
        return self._instrument.number(self._names.temperature)

    def _alarms(self) -> tuple[str, ...]:
        alarms = self._instrument.get(self._names.alarms) if self._names.alarms else 0
        return (f"{self._names.alarms} {alarms}",) if alarms else ()

    def _profile_runs(self) -> bool:
        return bool(self._names.program) and self._holds(self._names.program, self._names.program_mask)

    def _holds(self, attribute: str, mask: int | None) -> bool:
        if mask is None:
            return bool(self._instrument.get(attribute))
        return bool(int(self._instrument.number(attribute)) & mask)

    def _stopped(self) -> str:
        if not self._names.running or self._holds(self._names.running, self._names.running_mask):
            return ""
        return "the chamber does not run"

    def _end_profile(self) -> None:
        if not self._names.stop:
            raise RequestRejected(
                self.name,
                "a program is running, and the bench file names no method `stop` "
                "to end it; end it at the panel of the chamber",
            )
        self._instrument.call(self._names.stop)

    def _switch_on(self) -> None:
        if self._names.start and (not self._has_controlled or self._stopped()):
            self._start()
        elif not self._names.start:
            super()._switch_on()

    def _start(self) -> None:
        self._instrument.call(self._names.start)


#: A ThermoStream by PyMeasure's class: its air flow is what heats and cools.
ATS545 = {
    "instrument": "pymeasure.instruments.temptronic:ATS545",
    "port": "sim://ats-545",
    "setpoint": "temperature_setpoint",
    "start": "start",
    "stop": "shutdown",
}
DRIVER = ChamberDriver(LibraryChamberSettings, LibraryChamber, Trial(section=ATS545))
