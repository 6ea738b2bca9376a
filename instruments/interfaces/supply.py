"""Interface of programmable power supplies of the units. Voltages in V at the output of the supply."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from instruments.interfaces.gyro import Channel
from instruments.interfaces.reference import ReferenceState


@dataclass(frozen=True)
class SupplyLimits:
    """What the units may be supplied with, as the bench file says."""

    nominal_v: float
    min_v: float
    max_v: float
    current_limit_a: float
    tolerance_v: float  #: the measured voltage may be off the one that was set by so much

    def complaint(self, voltage_v: float) -> str | None:
        """Return which limit a voltage passes, or None."""
        if self.min_v - 1e-9 <= voltage_v <= self.max_v + 1e-9:
            return None
        return f"{voltage_v:.6g} V is outside the {self.min_v:g} to {self.max_v:g} V of the supply"

    def voltage_v(self, deviation_pct: float) -> float:
        """Return the voltage that is so many per cent off the nominal one, V."""
        return round(self.nominal_v * (1.0 + deviation_pct / 100.0), 6)


class Supply(Protocol):
    """A power supply. Every failure is an InstrumentError. It is also read as a reference: its voltage is logged."""

    name: str
    limits: SupplyLimits
    safe_state: str  #: "nominal" or "off"

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the measured voltage as a channel, named by its column of the recording."""
        ...

    def identify(self) -> str:
        """Get model and serial number; raises WrongInstrument for one that cannot give what the bench file says."""
        ...

    def is_on(self) -> bool:
        """Get whether the output is on."""
        ...

    def set_voltage_v(self, voltage_v: float) -> float:
        """Set the voltage, with the current limit, and switch the output on; returns the set point read back, V.

        Raises LimitError for a voltage outside the limits; nothing was sent then.
        """
        ...

    def switch_off(self) -> None:
        """Switch the output off, and read that back."""
        ...

    def read(self) -> ReferenceState:
        """Get the measured voltage.

        Raises RequestRejected where it left the voltage that was set, once it had arrived there.
        """
        ...

    def make_safe(self) -> float:
        """Set the supply to its safe state; returns the set point read back, V, 0 with the output off.

        The nominal voltage; an output that is off stays off. With safe_state "off": the output off.
        """
        ...

    def close(self) -> None:
        """Close the link. The supply keeps its output."""
        ...
