"""Interface of thermal chambers. Temperatures in deg C."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class ChamberLimits:
    """The narrower of the controller's own set-point limits and the bench file's."""

    min_c: float
    max_c: float
    resolution_c: float  #: a set point is rounded to a multiple of this
    ramp_c_per_min: float  #: fastest ramp of the air, for planning


@dataclass(frozen=True)
class ChamberState:
    """One poll of the controller."""

    t_s: float
    temperature_c: float
    setpoint_c: float
    alarms: tuple[str, ...] = ()
    given_c: float | None = None  #: the set point that labctl gave last; None before it did
    foreign: tuple[str, ...] = ()  #: what others have changed since then, in words


class Chamber(Protocol):
    """A thermal chamber. Every failure is an InstrumentError."""

    name: str
    safe_c: float  #: set point of the safe state

    @property
    def limits(self) -> ChamberLimits:
        """Get the limits of set points; the first use may ask the controller and raise."""
        ...

    def identify(self) -> str:
        """Get model or part number; raises WrongInstrument for another controller or units other than deg C."""
        ...

    def set_temperature_c(self, temperature_c: float) -> float:
        """Write the set point: limited, rounded, written on change only. Returns the value read back."""
        ...

    def read(self) -> ChamberState:
        """Get air temperature, set point and alarms."""
        ...

    def make_safe(self) -> float:
        """Set the chamber to its safe set point; returns the value read back."""
        ...

    def close(self) -> None:
        """Close the link. The controller keeps its set point."""
        ...
