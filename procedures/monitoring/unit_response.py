"""Whether a unit answers the table: from rate to rate its output changes by about as much as the table's rate does.

It compares by the nominal scale factor, so in the second data set of a mounting it finds a unit in another mode, on
another axis, upside down or not fixed to the table, and nothing that a calibration is for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from instruments.interfaces.gyro import Readings
from instruments.positions import AXES, Position
from procedures.monitoring.turn_course import Nominal

#: Rates that differ by less say nothing, deg/s: drift is no answer.
MIN_CHANGE_DPS = 5.0
#: Limits of the change of the output over that of the rate.
MIN_SHARE, LARGEST_SHARE = 0.5, 2.0
#: Of a tilted mounting an axis is compared that turns at so much of the table's rate at least.
MIN_ALONG = 0.3
#: A rate that comes to less was not measured as a rate.
NOTHING_SHARE = 0.2


@dataclass
class _Sums:
    n: int = 0
    rate_dps: dict[str, float] = field(default_factory=dict)  #: axis -> sum

    def mean_dps(self) -> dict[str, float]:
        return {axis: total / self.n for axis, total in self.rate_dps.items()} if self.n else {}


class UnitResponse:
    """Mean outputs of units at the rates of one mounting."""

    def __init__(self) -> None:
        self._outputs: dict[str, Mapping[str, Nominal]] = {}
        self._mounting: tuple[int, int] | None = None
        self._sums: dict[str, _Sums] = {}
        self._earlier: dict[str, list[tuple[float, dict[str, float]]]] = {}
        self._confirmed: set[str] = set()
        self._unconfirmed: dict[str, list[int]] = {}

    def expect(self, name: str, outputs: Mapping[str, Nominal]) -> None:
        """Take note of what the channels of a unit mean; those without a nominal scale factor are left out."""
        self._outputs[name] = {axis: output for axis, output in outputs.items() if output.is_scaled}

    def begin(self, mounting: tuple[int, int]) -> None:
        """Begin a data set of a mounting and powered session."""
        if mounting != self._mounting:
            self._mounting, self._earlier = mounting, {}
            self._confirmed, self._unconfirmed = set(), {}
        self._sums = {}

    def add(self, name: str, readings: Readings) -> None:
        """Take one block of one unit in."""
        sums = self._sums.setdefault(name, _Sums())
        sums.n += int(readings.valid.sum())
        for axis, output in self._outputs.get(name, {}).items():
            rates = output.rate_dps(readings.raw[output.channel.name][readings.valid])
            sums.rate_dps[axis] = sums.rate_dps.get(axis, 0.0) + float(rates.sum())

    def keep(self, names: Iterable[str], number: int) -> None:
        """Take note of a complete data set, which no comparison confirms yet for units that never answered a change."""
        for name in names:
            if name not in self._confirmed:
                self._unconfirmed.setdefault(name, []).append(number)

    def unconfirmed(self, name: str) -> tuple[int, ...]:
        """Return the complete data sets of this mounting in which a unit may not have followed the table; once."""
        return tuple(self._unconfirmed.pop(name, ()))

    def complaint(self, name: str, rate_dps: float, position: Position, max_rate_dps: float) -> str:
        """Return what is wrong with the answer of a unit to the table's rate, deg/s; empty where nothing is."""
        now = self._sums.get(name, _Sums()).mean_dps()
        up = {axis: share for axis, share in zip(AXES, position.up, strict=True) if abs(share) >= MIN_ALONG}
        if not up.keys() & now.keys() or abs(rate_dps) > max_rate_dps:
            return ""
        earlier = self._earlier.setdefault(name, [])
        before = max(earlier, key=lambda each: abs(each[0] - rate_dps), default=None)
        earlier.append((rate_dps, now))
        if before is None or abs(rate_dps - before[0]) * min(map(abs, up.values())) < MIN_CHANGE_DPS:
            return ""
        change_dps = rate_dps - before[0]
        changes = {axis: mean - before[1][axis] for axis, mean in now.items()}
        for axis, along in up.items():
            share = changes[axis] / (along * change_dps) if axis in changes else 1.0
            if not MIN_SHARE <= share <= LARGEST_SHARE:
                shares = {other: change / (along * change_dps) for other, change in changes.items()}
                return (
                    f"from {before[0]:g} to {rate_dps:.5g} deg/s of the table its output about {axis} changed by "
                    f"{changes[axis]:+.3g} deg/s, {100 * share:.3g} % of {_that(along)}, limits "
                    f"{100 * MIN_SHARE:g} and {100 * LARGEST_SHARE:g} %; {_advice(shares, axis, position)}"
                )
        self._confirmed.add(name)
        self._unconfirmed.pop(name, None)
        return ""


def _that(along: float) -> str:
    return "that" if abs(along) == 1.0 else f"the {100 * abs(along):.3g} % of that which turn about this axis"


def _advice(shares: Mapping[str, float], axis: str, position: Position) -> str:
    """Return what to do about an output that does not follow; `shares` are of the rate about its own axis."""
    share = shares[axis]
    other = max(shares, key=lambda each: abs(shares[each]))
    if other not in position.axes and abs(shares[other]) >= MIN_SHARE:
        return f"its output about {other} shows the rate: mount the unit with {position.end} up"
    if -LARGEST_SHARE <= share <= -MIN_SHARE:
        return f"its sign is reversed: mount the unit with {position.end} up, or correct the sign of its scale"
    if abs(share) < NOTHING_SHARE:
        return (
            "check that the unit is fixed to the table, and its mode: one that sends the angle of each sample instead "
            "of the rate gives a small number"
        )
    return "check the unit and scale of its output in the bench file, and its range and mode"
