"""How warm a unit is while a campaign runs, before it runs: the chamber's ramp, its air and the unit behind it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array

#: Time constant of a unit behind the air around it, s, where no earlier recording says it.
USUAL_UNIT_TAU_S = 720.0
#: Spacing of a computed course, s.
STEP_S = 10.0


@dataclass(frozen=True)
class HeatFlow:
    """What heat does between a set point and a thermometer."""

    ramp_c_per_min: float  #: fastest change of the set point; infinite: at once
    air_tau_s: float  #: first-order lag of the air behind the ramp
    unit_tau_s: float = USUAL_UNIT_TAU_S  #: and of the unit's own thermometer behind the air

    def settling_s(self, way_c: float, change_c: float, window_s: float) -> float:
        """Return the time, s, after which a unit that is `way_c` (K) off changes by less than `change_c` in a window.

        The unit nears the air exponentially; the window ends at that time.
        """
        first = abs(way_c) * -math.expm1(-window_s / self.unit_tau_s)
        if first <= change_c:
            return window_s
        return window_s + self.unit_tau_s * math.log(first / change_c)

    def change_c(self, way_c: float, held_s: float, window_s: float) -> float:
        """Return the change, K, over a window that ends `held_s` after the unit was `way_c` off."""
        begin_s = max(held_s - window_s, 0.0)
        return abs(way_c) * math.exp(-begin_s / self.unit_tau_s) * -math.expm1(-window_s / self.unit_tau_s)


@dataclass(frozen=True)
class HeatCourse:
    """Temperatures at even times from 0 on, `STEP_S` apart."""

    air_c: Array  #: (k,)
    unit_c: Array  #: (k,)

    @staticmethod
    def constant_in_steps(temperature_c: Array, each_s: float) -> HeatCourse:
        """Return a course that has each temperature (n,) for a time, s, and then the next at once."""
        values = np.repeat(temperature_c, round(each_s / STEP_S))
        return HeatCourse(values, values)

    @property
    def t_s(self) -> Array:
        """The times, (k,) s."""
        return np.asarray(STEP_S * np.arange(len(self.unit_c)), dtype=np.float64)

    def mean_c(self, begin_s: Array, end_s: Array) -> Array:
        """Return the unit's mean temperature between times (n,) and (n,), as (n,) deg C."""
        whole = np.concatenate([[0.0], np.cumsum(0.5 * STEP_S * (self.unit_c[1:] + self.unit_c[:-1]))])
        area: Array = np.interp(end_s, self.t_s, whole) - np.interp(begin_s, self.t_s, whole)
        return np.asarray(area / np.maximum(end_s - begin_s, 1e-9), dtype=np.float64)

    def slope_k_s(self, begin_s: Array, end_s: Array) -> Array:
        """Return the unit's mean rate of change between times (n,) and (n,), as (n,) K/s."""
        change = np.interp(end_s, self.t_s, self.unit_c) - np.interp(begin_s, self.t_s, self.unit_c)
        return np.asarray(change / np.maximum(end_s - begin_s, 1e-9))


def heat_course(flow: HeatFlow, set_points: Sequence[tuple[float, float]], start_c: float, end_s: float) -> HeatCourse:
    """Return the course of temperatures for set points (time in s, deg C), rising in time, from `start_c` at rest."""
    n = math.ceil(end_s / STEP_S) + 2
    target = np.full(n, start_c)
    for t_s, set_c in set_points:
        target[min(math.ceil(t_s / STEP_S), n) :] = set_c
    ramped = _ramped(target, start_c, flow.ramp_c_per_min * STEP_S / 60.0)
    air = _followed(ramped, start_c, flow.air_tau_s)
    return HeatCourse(air, _followed(air, start_c, flow.unit_tau_s))


def _ramped(target: Array, start_c: float, step_c: float) -> Array:
    """Return a set value that nears its target (n,) by at most `step_c` in each step."""
    if math.isinf(step_c):
        return target
    ramped = np.empty(len(target))
    now, first = start_c, 0
    for end in [*(np.flatnonzero(np.diff(target)) + 1).tolist(), len(target)]:
        goal = float(target[first])
        way = goal - now
        moved = np.minimum(step_c * np.arange(1, end - first + 1), abs(way))
        ramped[first:end] = now + math.copysign(1.0, way) * moved
        now, first = float(ramped[end - 1]), end
    return ramped


def _followed(course: NDArray[np.float64], start_c: float, tau_s: float) -> Array:
    """Return a first-order follower of a course (n,) that changes on straight lines; both come from `start_c`."""
    if tau_s <= 0:
        return course
    keep = math.exp(-STEP_S / tau_s)
    mean = (1.0 - keep) * tau_s / STEP_S
    followed, value = [], start_c
    values = course.tolist()
    for last, new in zip([start_c, *values[:-1]], values, strict=True):
        value = keep * value + (mean - keep) * last + (1.0 - mean) * new
        followed.append(value)
    return np.array(followed)
