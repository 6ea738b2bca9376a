"""Shewhart control charts of single values: limits from stated uncertainties, and from the history.

From the history: mean, and three standard deviations by the average moving range of two, divided by d2 = 1.128 (ISO
7870-2:2013, 5.3; NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2). A value is judged by the values before it,
those out of limits left out: a value widens no limit by which it is judged itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from labctl.errors import BadInput

#: Expected range of two values of a normal distribution of standard deviation 1 (ISO 7870-2, table 1: d2 for n = 2).
D2 = 1.128
#: Standard deviations from the centre line to the warning and to the action limits.
WARNING, ACTION = 2.0, 3.0
#: Values of a history without which it gives no limits. By limits from 8 values one good value in 33 is out (from 6
#: one in 22, of limits that are known one in 370).
MIN_HISTORY = 8
#: A spread of a history below these is rounding of the computation and no scatter: a part of the values themselves, and
#: a part of their standard uncertainty (a bias near zero is computed from readings of hundreds of deg/s).
ROUNDING_OF_VALUE, ROUNDING_OF_U = 1e-12, 1e-6

State = Literal["in", "warning", "out", "unknown"]
Basis = Literal["history", "stated u"]


@dataclass(frozen=True)
class Limits:
    """Centre line and standard deviation of a chart, in the unit of its values."""

    basis: Basis
    centre: float
    sigma: float
    values: int  #: how many values they are from; 0: none, they are stated

    @property
    def low(self) -> float:
        """Lower action limit."""
        return self.centre - ACTION * self.sigma

    @property
    def high(self) -> float:
        """Upper action limit."""
        return self.centre + ACTION * self.sigma

    def state_of(self, value: float) -> State:
        """Return where a value is: inside, beyond a warning limit, or out of the action limits."""
        size = abs(value - self.centre)
        if size > ACTION * self.sigma:
            return "out"
        return "warning" if size > WARNING * self.sigma else "in"


@dataclass(frozen=True)
class ChartPoint:
    """One value with its standard uncertainty and, where they are known, what it should be."""

    value: float
    u: float | None  #: None: not known, and the chart has limits from its history only
    expected: float | None = None  #: such as the value that certificates predict; None: the mean of those before
    u_expected: float = 0.0


@dataclass(frozen=True)
class Judged:
    """A value with the limits that it was judged by; no limits: it is the first, and nothing is known."""

    point: ChartPoint
    limits: tuple[Limits, ...]

    @property
    def state(self) -> State:
        """The worst state by any of the limits."""
        states = {limits.state_of(self.point.value) for limits in self.limits}
        order: tuple[State, ...] = ("out", "warning", "in")
        for state in order:
            if state in states:
                return state
        return "unknown"


def limits_from_history(values: Sequence[float]) -> Limits:
    """Return the limits of an individuals chart, from at least two values in order of time. Raises BadInput."""
    if len(values) < 2:
        raise BadInput(f"control limits from a history of {len(values)} values; give at least 2 in order of time")
    ranges = [abs(second - first) for first, second in pairwise(values)]
    return Limits("history", float(np.mean(values)), float(np.mean(ranges)) / D2, len(values))


def judged(points: Sequence[ChartPoint]) -> list[Judged]:
    """Return each value of a chart, in order of time, with its limits from those before it and from what is stated."""
    judged_points: list[Judged] = []
    history: list[ChartPoint] = []
    for point in points:
        one = Judged(point, tuple(_limits(point, history)))
        judged_points.append(one)
        if one.state != "out":
            history.append(point)
    return judged_points


def _limits(point: ChartPoint, history: Sequence[ChartPoint]) -> Iterator[Limits]:
    u_values = [each.u for each in history if each.u is not None]
    if point.u is not None and point.expected is not None:
        yield Limits("stated u", point.expected, math.hypot(point.u, point.u_expected), 0)
    elif point.u is not None and history and len(u_values) == len(history):
        centre = float(np.mean([each.value for each in history]))
        u_centre = math.sqrt(sum(u**2 for u in u_values)) / len(history)
        yield Limits("stated u", centre, math.hypot(point.u, u_centre), len(history))
    if len(history) >= MIN_HISTORY and _scattered(history):
        yield limits_from_history([each.value for each in history])


def _scattered(history: Sequence[ChartPoint]) -> bool:
    """Whether a history shows a scatter: equal values, as coarse steps give, say nothing of it."""
    values = [each.value for each in history]
    of_value = ROUNDING_OF_VALUE * max(map(abs, values))
    of_u = ROUNDING_OF_U * min((each.u for each in history if each.u is not None), default=0.0)
    return max(values) - min(values) > max(of_value, of_u)
