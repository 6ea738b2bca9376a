"""Questions to the table during a data set: a table that stopped, or does not answer, is noticed while it matters.

A motion controller confirms a run only at its end, up to minutes later. Until then the table's state is asked through
its driver; that moves nothing and takes some milliseconds, which the ports of the units bridge.
"""

from __future__ import annotations

from contextlib import suppress

from instruments.clock import Clock
from instruments.errors import NoReply
from instruments.interfaces.table import RateTable, Spin
from procedures.contracts.errors import TableStopped

#: From question to question, s. With the ramps before and after, up to 13 s each, and a block of readings in between,
#: a table is never without a question for more than 30 s.
ASK_EVERY_S = 15.0


class TableWatch:
    """The table during one run at constant rate, from the acceptance of its move on."""

    def __init__(self, table: RateTable, clock: Clock, spin: Spin) -> None:
        self._table, self._clock, self._spin = table, clock, spin
        ramp_s = abs(spin.rate_dps) / table.limits.max_acceleration_dps2
        self._next_s = spin.steady_from_s - ramp_s + ASK_EVERY_S

    @property
    def next_s(self) -> float:
        """Clock time at which the table is to be asked again."""
        return self._next_s

    def ask(self) -> None:
        """Ask the table whether it moves as commanded, if a question is due.

        One lost reply is no fault: the table is asked once more. Raises TableStopped for a table that stands during
        a run, or moves during a rest; NoReply or LinkError for one that does not answer.
        """
        if self._clock.now_s() < self._next_s:
            return
        moving = self._is_moving()
        self._next_s = self._clock.now_s() + ASK_EVERY_S
        if moving == (self._spin.rate_dps != 0):
            return
        demand = f"run at {self._spin.rate_dps:g} deg/s" if self._spin.rate_dps else "rest"
        into_s = self._clock.now_s() - self._spin.steady_from_s
        raise TableStopped(
            f"{self._table.name}: {'moves' if moving else 'stands still'} {into_s:.0f} s after the beginning of "
            f"a {demand}; check motor, "
            "load and step clock, and home the table"
        )

    def _is_moving(self) -> bool:
        with suppress(NoReply):
            return self._table.is_moving()
        return self._table.is_moving()
