"""What the two Watlow controllers share: a set point that is limited, rounded, written on change and read back."""

from __future__ import annotations

from abc import ABC, abstractmethod

from instruments.bench import ChamberSettings
from instruments.chamber import ChamberLimits, ChamberState
from instruments.clock import Clock
from instruments.errors import LimitError, Refused, WrongInstrument
from instruments.modbus import Registers

REPLY_S = 1.0


class Watlow(ABC):
    """A chamber on a Watlow controller. Limits are asked of the controller once, and the narrower of both counts."""

    def __init__(self, settings: ChamberSettings, registers: Registers, clock: Clock) -> None:
        self.name = "chamber"
        self.settings = settings
        self.safe_c = settings.safe_c
        self._registers, self._clock = registers, clock
        self._limits: ChamberLimits | None = None
        self._written_c: float | None = None

    @property
    def limits(self) -> ChamberLimits:
        """The narrower of the controller's set-point limits and the bench file's."""
        if self._limits is None:
            low, high = self._controller_limits()
            settings = self.settings
            self._limits = ChamberLimits(
                max(low, settings.min_c), min(high, settings.max_c), self._resolution_c(), settings.ramp_c_per_min
            )
        return self._limits

    @abstractmethod
    def identify(self) -> str:
        """Get what the controller says it is; raises WrongInstrument when it is another or speaks Fahrenheit."""

    @abstractmethod
    def _controller_limits(self) -> tuple[float, float]:
        """Return the controller's own set-point limits, deg C."""

    @abstractmethod
    def _resolution_c(self) -> float:
        """Return the step of a set point, deg C."""

    @abstractmethod
    def _write_setpoint(self, temperature_c: float) -> None:
        """Write a rounded set point."""

    @abstractmethod
    def _read_setpoint(self) -> float:
        """Return the set point, deg C."""

    @abstractmethod
    def _read_air(self) -> float:
        """Return the air temperature, deg C; raises InstrumentError when the controller marks it invalid."""

    @abstractmethod
    def _alarms(self) -> tuple[str, ...]:
        """Return what the controller complains of."""

    def set_temperature_c(self, temperature_c: float) -> float:
        """Control the set point, deg C: limited, rounded, written on change only (EEPROM wear), read back."""
        limits = self.limits
        if not limits.min_c <= temperature_c <= limits.max_c:
            raise LimitError(
                self.name,
                f"set point {temperature_c:g} deg C lies outside {limits.min_c:g} to {limits.max_c:g} deg C "
                "(controller and bench file); nothing was written",
            )
        rounded = round(temperature_c / limits.resolution_c) * limits.resolution_c
        if self._written_c is None or abs(rounded - self._read_setpoint()) > limits.resolution_c / 2:
            self._write_setpoint(rounded)
        found = self._read_setpoint()
        if abs(found - rounded) > limits.resolution_c / 2:
            raise Refused(
                self.name,
                f"set point {rounded:g} deg C was written but {found:g} deg C read back; "
                "the controller must show its run page",
            )
        self._written_c = rounded
        return found

    def read(self) -> ChamberState:
        """Get air temperature, set point (deg C) and alarms."""
        return ChamberState(self._clock.now_s(), self._read_air(), self._read_setpoint(), self._alarms())

    def make_safe(self) -> float:
        """Control the chamber to its safe set point, deg C; returns what was read back."""
        return self.set_temperature_c(self.safe_c)

    def close(self) -> None:
        """Control the link: close it. The controller keeps its set point."""
        self._registers.close()

    def _wrong(self, text: str) -> WrongInstrument:
        return WrongInstrument(self.name, f"{text}; check address and driver in the bench file")
