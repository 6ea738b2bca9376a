"""Courses of a table's rate: ramps and sine sweeps, with the rate and the angle that they have at any time.

Rates in deg/s, positive counter-clockwise seen from above; times in s since the course began.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Steps of a course in the fastest period that it has, and the longest step, s: what walks through it need.
STEPS_OF_PERIOD, LONGEST_STEP_S = 200, 0.01
#: Panels in the fastest period by which an angle is integrated, each by Gauss and Legendre: better than 1e-9 of it.
PANELS_OF_PERIOD = 12
NODES, WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class Ramp:
    """A rate that changes evenly, and then stays."""

    from_dps: float
    to_dps: float
    duration_s: float
    kind: Literal["ramp"] = "ramp"

    @property
    def text(self) -> str:
        """What it does, in words."""
        return f"ramp from {self.from_dps:+g} to {self.to_dps:+g} deg/s in {self.duration_s:g} s"

    @property
    def begins_dps(self) -> float:
        """The rate from which it begins, deg/s."""
        return self.from_dps

    @property
    def step_s(self) -> float:
        """How short a step of the course is, s."""
        return LONGEST_STEP_S

    @property
    def largest_dps(self) -> float:
        """Its largest rate, without its sign, deg/s."""
        return max(abs(self.from_dps), abs(self.to_dps))

    @property
    def largest_dps2(self) -> float:
        """Its largest acceleration, without its sign, deg/s^2."""
        return abs(self.to_dps - self.from_dps) / self.duration_s

    def rate_dps(self, t_s: Array) -> Array:
        """Return the rate at times (n,), deg/s."""
        share = np.clip(t_s / self.duration_s, 0.0, 1.0)
        return np.asarray(self.from_dps + (self.to_dps - self.from_dps) * share)

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle turned since it began, (n,) degrees."""
        inside = np.clip(t_s, 0.0, self.duration_s)
        slope = (self.to_dps - self.from_dps) / self.duration_s
        outside = np.where(t_s < 0, self.from_dps * t_s, self.to_dps * (t_s - inside))
        return np.asarray(self.from_dps * inside + 0.5 * slope * inside**2 + outside)


@dataclass(frozen=True)
class SineSweep:
    """A sine whose frequency grows by the same factor in equal times; its size fades in and out."""

    amplitude_dps: float
    from_hz: float
    to_hz: float
    duration_s: float
    fade_s: float = 2.0
    late_s: float = 0.0  #: as it was run: by how much later than planned it began to fade out
    kind: Literal["sine_sweep"] = "sine_sweep"

    @property
    def text(self) -> str:
        """What it does, in words."""
        return (
            f"sine of {self.amplitude_dps:g} deg/s from {self.from_hz:g} to {self.to_hz:g} Hz in {self.duration_s:g} s"
        )

    @property
    def begins_dps(self) -> float:
        """The rate from which it begins, deg/s."""
        return 0.0

    @property
    def step_s(self) -> float:
        """How short a step of the course is, s."""
        return min(LONGEST_STEP_S, 1.0 / (STEPS_OF_PERIOD * max(self.from_hz, self.to_hz)))

    @property
    def largest_dps(self) -> float:
        """Its largest rate, deg/s."""
        return self.amplitude_dps

    @property
    def largest_dps2(self) -> float:
        """Its largest acceleration, deg/s^2; infinite where it does not fade out."""
        fading = self.amplitude_dps / self.fade_s if self.fade_s else math.inf
        return math.hypot(2 * math.pi * max(self.from_hz, self.to_hz) * self.amplitude_dps, fading)

    @property
    def fades_s(self) -> float:
        """When it begins to fade out as planned, s."""
        return max(self.duration_s - self.fade_s, 0.0)

    def rate_dps(self, t_s: Array) -> Array:
        """Return the rate at times (n,), deg/s."""
        return self._size_dps(t_s) * np.sin(self._phase_rad(t_s))

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle turned since it began, (n,) degrees."""
        return _sweep_angle(self, 0.0, t_s)

    def quadrature_deg(self, t_s: Array) -> Array:
        """Return the angle, (n,) degrees, of the same course a quarter of a period ahead."""
        return _sweep_angle(self, math.pi / 2, t_s)

    def shifted_rate_dps(self, shift_rad: float, t_s: Array) -> Array:
        """Return the rate, (n,) deg/s, of the course ahead by a phase."""
        return np.asarray(self._size_dps(t_s) * np.sin(self._phase_rad(t_s) + shift_rad))

    def _phase_rad(self, t_s: Array) -> Array:
        growth = math.log(self.to_hz / self.from_hz) / self.duration_s
        inside = np.clip(t_s, 0.0, self.duration_s)
        cycles = self.from_hz * (np.expm1(growth * inside) / growth if growth else inside)
        return np.asarray(2 * math.pi * (cycles + self.to_hz * np.maximum(t_s - self.duration_s, 0.0)))

    def _size_dps(self, t_s: Array) -> Array:
        end_s = self.duration_s + self.late_s
        left_s = np.minimum(t_s, end_s - t_s)
        share = left_s / self.fade_s if self.fade_s else np.where(left_s > 0, 1.0, 0.0)
        return np.asarray(self.amplitude_dps * np.clip(share, 0.0, 1.0))


RateCourse = Ramp | SineSweep


@lru_cache(maxsize=8)
def _sweep_grid(course: SineSweep, shift_rad: float) -> tuple[float, Array]:
    """Return the step of a grid over a sweep, s, and the angles at its points, (k,) degrees."""
    whole_s = course.duration_s + max(course.late_s, 0.0)
    panels = max(math.ceil(whole_s * PANELS_OF_PERIOD * max(course.from_hz, course.to_hz)), 16)
    step_s = whole_s / panels
    begins = step_s * np.arange(panels)
    parts = _gauss(course, shift_rad, np.asarray(begins, dtype=np.float64), np.full(panels, step_s))
    return step_s, np.concatenate([[0.0], np.cumsum(parts)])


def _gauss(course: SineSweep, shift_rad: float, from_s: Array, length_s: Array) -> Array:
    """Return the integrals, (n,) degrees, of the rate over short stretches."""
    total = np.zeros(len(from_s))
    for node, weight in zip(NODES.tolist(), WEIGHTS.tolist(), strict=True):
        total += weight * course.shifted_rate_dps(shift_rad, from_s + (node + 1) / 2 * length_s)
    return np.asarray(total * length_s / 2)


def _sweep_angle(course: SineSweep, shift_rad: float, t_s: Array) -> Array:
    step_s, angles = _sweep_grid(course, shift_rad)
    inside = np.clip(t_s, 0.0, step_s * (len(angles) - 1))
    k = np.minimum((inside / step_s).astype(np.int64), len(angles) - 2)
    return np.asarray(angles[k] + _gauss(course, shift_rad, step_s * k, inside - step_s * k))


def course_complaint(course: RateCourse, max_rate_dps: float, max_acceleration_dps2: float) -> str:
    """Return which limit of a table a course passes, with what to do; empty for none."""
    if course.largest_dps > max_rate_dps * (1 + 1e-9):
        limit = f"the limit of the table is {max_rate_dps:g} deg/s"
        return f"reaches {course.largest_dps:g} deg/s, but {limit}; make it slower"
    if course.largest_dps2 > max_acceleration_dps2 * (1 + 1e-9):
        means = "duration_s longer" if isinstance(course, Ramp) else "amplitude_dps or to_hz lower, or fade_s longer"
        return (
            f"needs {course.largest_dps2:.5g} deg/s^2, but the limit of the table is {max_acceleration_dps2:g} "
            f"deg/s^2; make {means}"
        )
    return ""
