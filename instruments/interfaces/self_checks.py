"""What a driver may have beside its interface for a check of the bench: what keeps it from work, and its period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from instruments.interfaces.gyro import Readings


@runtime_checkable
class SelfChecking(Protocol):
    """An instrument that can say why it could not do its work although it answers."""

    def shortcomings(self) -> tuple[str, ...]:
        """Get what keeps the instrument from its work, each with what to do; nothing is changed. Raises as `read`."""
        ...


#: A period that is off by less than this share, as any crystal is, needs no confirmation.
NEGLIGIBLE_SHARE = 2e-4


@dataclass(frozen=True)
class StreamPeriod:
    """Period of a stream by the clock of the computer, from the arrivals of its readings."""

    nominal_s: float  #: of the bench file
    measured_s: float | None  #: None where it is not known to half a per cent
    u_share: float  #: standard uncertainty as a share of the period
    used_s: float | None = None  #: by which readings have their times; None: the nominal one

    @property
    def is_unconfirmed(self) -> bool:
        """Whether the arrivals suggest another period than the one in use, beyond two standard uncertainties.

        Less than `NEGLIGIBLE_SHARE` does not count: in a data set the times do not bend by it.
        """
        used_s = self.used_s or self.nominal_s
        limit = max(2.0 * self.u_share, NEGLIGIBLE_SHARE)
        return self.measured_s is not None and abs(self.measured_s / used_s - 1.0) > limit


@runtime_checkable
class StreamingGyro(Protocol):
    """A gyro that sends readings by itself, at a period of its own clock."""

    @property
    def period(self) -> StreamPeriod:
        """Get what is known of the period since the stream was started."""
        ...

    @property
    def counter_step(self) -> tuple[int, int] | None:
        """Get the usual step of the counter of its frames, and the one that the bench file means; None without."""
        ...


@runtime_checkable
class LateTelling(Protocol):
    """A gyro that can say that its readings come late, and that it is still open whether some are lost."""

    @property
    def is_late(self) -> bool:
        """Get whether the stream is too far behind the clock."""
        ...


@runtime_checkable
class KeepingBack(Protocol):
    """A gyro that keeps readings back while it is open whether readings before them are lost."""

    def kept_back(self) -> Readings | None:
        """Get the readings that are kept back, each once, at the times that they have if none is lost; None: none are.

        For a stream that has ended: nothing will decide any more.
        """
        ...
