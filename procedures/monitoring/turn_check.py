"""Whether what came out of a gyro during a turn by hand is the turn that was asked for.

It compares by the nominal scale factor, right after the turn, so it finds what a hand does wrong and not what a
calibration is for: the tolerance is that of the scale factor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from instruments.interfaces.gyro import Readings
from instruments.positions import Position
from procedures.contracts.steps import Turn
from procedures.monitoring.turn_course import Array, Course, Nominal
from procedures.recipe.turns import TurnRules

#: Parts of a rest whose means are compared, s, and how many standard deviations of such a mean noise may be off.
PART_S, NOISE = 0.25, 5.0
#: From the median of absolute values to a standard deviation.
ROBUST = 1.4826
#: A unit is at its limit from this share of it on.
LIMIT_SHARE = 0.99
#: Another axis was turned about when more came out of it than of the right one, and at least this share of the angle.
OTHER_SHARE = 0.5
#: Less than this share of the angle is no turn.
NOTHING_SHARE = 0.1
#: Standard uncertainties of the angle that a turn may be off in any case.
UNCERTAINTIES = 5.0


@dataclass(frozen=True)
class UnitTurn:
    """What one unit said before, during and after a turn."""

    name: str
    before: Course
    during: Course
    after: Course
    max_rate_dps: float

    def bias_dps(self, axis: str) -> float:
        """Return the mean output of an axis in the two rests, deg/s."""
        return 0.5 * (self.before.mean_dps(axis) + self.after.mean_dps(axis))

    def angles_deg(self) -> dict[str, float]:
        """Return the integral of each axis less its bias, deg."""
        return {axis: self.during.angle_deg(axis, self.bias_dps(axis)) for axis in self.during.outputs}


@dataclass(frozen=True)
class Stillness:
    """Output of one unit at rest, axis by axis, and the change from which on it is no longer at rest."""

    outputs: Mapping[str, Nominal]
    bias_dps: Mapping[str, float]
    limit_dps: Mapping[str, float]
    part: int  #: readings of the means that are compared

    @classmethod
    def of(cls, course_at_rest: Course, still_dps: float) -> Stillness:
        """Return the stillness that a rest shows."""
        n = _part(course_at_rest.sample_rate_hz)
        limits = {axis: _limit_dps(course_at_rest.rate_dps(axis), n, still_dps) for axis in course_at_rest.outputs}
        return cls(
            course_at_rest.outputs, {axis: course_at_rest.mean_dps(axis) for axis in course_at_rest.outputs}, limits, n
        )

    def is_left(self, readings: Readings) -> bool:
        """Return whether a unit moved in a block of readings. One that it marked bad may be at its limit."""
        if not readings.valid.all():
            return True
        for axis, output in self.outputs.items():
            rates = output.rate_dps(readings.raw[output.channel.name]) - self.bias_dps[axis]
            if len(rates) and float(np.abs(_means(rates, self.part)).max()) > self.limit_dps[axis]:
                return True
        return False


@dataclass(frozen=True)
class TurnResult:
    """What came out of a turn. `refused` is empty for a good one, else one sentence about what came out."""

    refused: str
    came_deg: float | None  #: about the axis that points up; None where the unit does not measure it


def check_turn(step: Turn, rules: TurnRules, unit: UnitTurn) -> TurnResult:
    """Return what came out of a turn of one unit, and why it is refused."""
    up = Position.of(step.position)
    axis, sign = up.axis, up.sign
    angles = unit.angles_deg()
    came = sign * angles[axis] if axis in angles else None
    refused = (
        _at_limit(unit)  # an output at its limit may be marked bad
        or _lost(rules, unit)
        or moved(unit.before, rules.still_dps, "before")
        or moved(unit.after, rules.still_dps, "after")
        or _moved_between(unit, rules.still_dps)
        or _other_axis(step, axis, angles)
        or ("" if came is None else _angle(step, rules, came, axis))
    )
    return TurnResult(refused, came)


def _lost(rules: TurnRules, unit: UnitTurn) -> str:
    courses = {"before the turn": unit.before, "of the turn": unit.during, "after the turn": unit.after}
    for when, course in courses.items():
        if len(course) < 2:
            return f"no readings {when} arrived; check cable and power"
        if course.lost > rules.max_lost:
            share, limit = 100 * course.lost, 100 * rules.max_lost
            return f"{share:.1f} % of the readings {when} were lost or bad, limit {limit:g} %"
    return ""


def _at_limit(unit: UnitTurn) -> str:
    if unit.during.largest_dps < LIMIT_SHARE * unit.max_rate_dps:
        return ""
    return (
        f"the output reached {unit.during.largest_dps:.0f} deg/s, but the unit measures only up to "
        f"{unit.max_rate_dps:g} deg/s; turn the unit more slowly"
    )


def moved(course_at_rest: Course, still_dps: float, when: str) -> str:
    """Return what moved in a rest, empty when nothing did: its mean over parts of a quarter of a second changed."""
    n = _part(course_at_rest.sample_rate_hz)
    for axis in course_at_rest.outputs:
        rates = course_at_rest.rate_dps(axis)
        parts = _means(rates, n)
        off = float(np.abs(parts - np.median(parts)).max()) if len(parts) > 1 else 0.0
        if off > _limit_dps(rates, n, still_dps):
            return f"the unit moved during the rest {when} the turn, by {off:.1f} deg/s about {axis}"
    return ""


def _part(sample_rate_hz: float) -> int:
    """Return the number of readings in each mean that is compared."""
    return max(int(PART_S * sample_rate_hz), 1)


def _means(rates: Array, n: int) -> Array:
    """Return means of n readings each, (k,), of readings (m,); of fewer than n readings their mean."""
    if len(rates) < n:
        return np.array([rates.mean()]) if len(rates) else np.zeros(0)
    return np.asarray(rates[: len(rates) // n * n].reshape(-1, n).mean(axis=1))


def _limit_dps(rates: Array, n: int, still_dps: float) -> float:
    """Return the change of a mean of n readings above which a unit moves: `still_dps` plus noise of the rest (m,)."""
    return still_dps + NOISE * _noise_dps(rates) / float(np.sqrt(n))


def _noise_dps(rates: Array) -> float:
    """Return the standard deviation of single readings (n,) by the differences of neighbours, deg/s."""
    return float(ROBUST * np.median(np.abs(np.diff(rates))) / np.sqrt(2.0)) if len(rates) > 1 else 0.0


def _moved_between(unit: UnitTurn, still_dps: float) -> str:
    for axis in unit.before.outputs:
        change = unit.after.mean_dps(axis) - unit.before.mean_dps(axis)
        if abs(change) > still_dps:
            return (
                f"the output about {axis} changed by {change:+.1f} deg/s between the rests before and after the "
                "turn; the unit moved during one of them"
            )
    return ""


def _other_axis(step: Turn, axis: str, angles: dict[str, float]) -> str:
    others = {name: abs(angle) for name, angle in angles.items() if name != axis}
    if not others:
        return ""
    most = max(others, key=lambda name: others[name])
    if others[most] < OTHER_SHARE * abs(step.turn_deg) or others[most] <= abs(angles.get(axis, 0.0)):
        return ""
    return f"the unit turned by {others[most]:.0f} deg about axis {most}, not about axis {axis}"


def _angle(step: Turn, rules: TurnRules, came_deg: float, axis: str) -> str:
    commanded_deg = step.turn_deg
    if abs(came_deg) < NOTHING_SHARE * abs(commanded_deg):
        return (
            f"the unit turned by only {abs(came_deg):.0f} deg about axis {axis} instead of {abs(commanded_deg):g} deg"
        )
    if came_deg * commanded_deg < 0:
        sense = "clockwise" if commanded_deg > 0 else "counter-clockwise"
        return f"the unit turned by {abs(came_deg):.0f} deg in the wrong direction, {sense}"
    if abs(came_deg - commanded_deg) <= max(rules.tolerance * abs(commanded_deg), UNCERTAINTIES * step.turn_u_deg):
        return ""
    only = "only " if abs(came_deg) < abs(commanded_deg) else ""
    return f"the unit turned by {only}{abs(came_deg):.0f} deg about axis {axis} instead of {abs(commanded_deg):g} deg"
