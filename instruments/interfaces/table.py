"""What every rate table can do. Angles in degrees, rates in deg/s, positive counter-clockwise seen from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class TableLimits:
    """What the table can do, from its bench file and its driver."""

    max_rate_dps: float
    max_acceleration_dps2: float
    step_deg: float  #: table angle of one motor step; 0 for a table without steps


@dataclass(frozen=True)
class Spin:
    """One run at constant rate, as it was started: when it is steady and where the table is meanwhile.

    `rate_dps` is the reference: what the step timing really gives. It is never the rate asked for.
    """

    asked_dps: float
    rate_dps: float
    steady_from_s: float  #: clock time
    steady_until_s: float
    angle_from_deg: float  #: unwrapped table angle at `steady_from_s`
    step_deg: float = 0.0

    def angle_deg(self, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the unwrapped table angle, (n,) degrees, at clock times `t_s` (n,) inside the steady part."""
        return self.angle_from_deg + self.rate_dps * (t_s - self.steady_from_s)

    def gate(self, from_s: float, duration_s: float) -> tuple[float, float]:
        """Return the part of the steady run that starts and ends on step edges, (start_s, end_s) clock time.

        It starts no earlier than `from_s` and is at least `duration_s` long where the steady part allows it, so that
        steps inside the gate over gate time is exactly `rate_dps` (instruments notes, 1.3).
        """
        if self.step_deg == 0 or self.rate_dps == 0:
            return from_s, min(from_s + duration_s, self.steady_until_s)
        period_s = self.step_deg / abs(self.rate_dps)
        edge = np.ceil((from_s - self.steady_from_s) / period_s - 1e-9)
        start_s = self.steady_from_s + edge * period_s
        room = np.floor((self.steady_until_s - start_s) / period_s + 1e-9)
        steps = min(np.ceil(duration_s / period_s - 1e-9), room)
        return float(start_s), float(start_s + steps * period_s)


class RateTable(Protocol):
    """A single-axis rate table. Every failure is an InstrumentError."""

    name: str
    limits: TableLimits

    def identify(self) -> str:
        """Get what the controller says it is; raises WrongInstrument when it is something else."""
        ...

    def achievable_dps(self, rate_dps: float) -> float:
        """Get the rate the table would really run when asked for `rate_dps`; raises LimitError beyond its limits."""
        ...

    def home(self) -> None:
        """Control the table to its home switch; the angle is 0 deg there."""
        ...

    def spin(self, rate_dps: float, steady_s: float) -> Spin:
        """Control the table to a constant rate that stays steady for at least `steady_s`; returns when it is steady.

        The table comes to rest by itself when the run is over. Rate 0 is a run at rest.
        """
        ...

    def settle(self, spin: Spin) -> None:
        """Control the end of a run: return once the table confirms that it stands still again."""
        ...

    def stop(self) -> None:
        """Control the table to rest, whatever it is doing. Safe to call at any time, also twice."""
        ...

    def is_moving(self) -> bool:
        """Get whether the table moves."""
        ...

    def angle_deg(self) -> float:
        """Get the unwrapped table angle since home, degrees."""
        ...

    def close(self) -> None:
        """Control the link: close it. The table is not stopped by this."""
        ...
