"""Interface of reference instruments: a thermometer or hygrometer whose value is traceable by itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from instruments.interfaces.gyro import Channel


@dataclass(frozen=True)
class ReferenceState:
    """One reading of every quantity."""

    t_s: float  #: clock time of the reply
    raw: Mapping[str, int]  #: channel name -> whole number, as the channel scales it


class Reference(Protocol):
    """A reference instrument. Every failure is an InstrumentError."""

    name: str

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Get the quantities, named by the columns of the recording: reference_c, humidity_pct ..."""
        ...

    def identify(self) -> str:
        """Get what the instrument says of itself; raises WrongInstrument for another serial number."""
        ...

    def read(self) -> ReferenceState:
        """Get one reading of every quantity."""
        ...

    def close(self) -> None:
        """Close the link."""
        ...
