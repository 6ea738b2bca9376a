"""Courses of the table's rate: ramps and sine sweeps, as a recipe writes them."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from procedures.recipe.rules import Number, Table

#: Steps of a course in the fastest period that it has, and the longest step, s.
STEPS_OF_PERIOD, LONGEST_STEP_S = 200, 0.01


class Ramp(Table):
    """A rate that changes evenly."""

    kind: Literal["ramp"]
    from_dps: Number
    to_dps: Number
    duration_s: Number = Field(gt=0, le=7200)

    @property
    def step_s(self) -> float:
        """How short a step of the course is, s."""
        return LONGEST_STEP_S

    def rate_dps(self, t_s: float) -> float:
        """Return the rate at a time since the start, s."""
        return self.from_dps + (self.to_dps - self.from_dps) * t_s / self.duration_s


class SineSweep(Table):
    """A sine whose frequency grows by the same factor in equal times; its size fades in and out."""

    kind: Literal["sine_sweep"]
    amplitude_dps: Number = Field(gt=0)
    from_hz: Number = Field(gt=0, le=500)
    to_hz: Number = Field(gt=0, le=500)
    duration_s: Number = Field(gt=0, le=7200)
    fade_s: Number = Field(default=2.0, ge=0)

    @property
    def step_s(self) -> float:
        """How short a step of the course is, s."""
        return min(LONGEST_STEP_S, 1.0 / (STEPS_OF_PERIOD * max(self.from_hz, self.to_hz)))

    def rate_dps(self, t_s: float) -> float:
        """Return the rate at a time since the start, s."""
        growth = math.log(self.to_hz / self.from_hz) / self.duration_s
        cycles = self.from_hz * (math.expm1(growth * t_s) / growth if growth else t_s)
        fade = min(t_s, self.duration_s - t_s) / self.fade_s if self.fade_s else 1.0
        return self.amplitude_dps * max(min(fade, 1.0), 0.0) * math.sin(2 * math.pi * cycles)


Profile = Annotated[Ramp | SineSweep, Field(discriminator="kind")]
