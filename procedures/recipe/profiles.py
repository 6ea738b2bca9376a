"""Courses of the table's rate: ramps and sine sweeps, as a recipe writes them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from instruments.interfaces import rate_course
from procedures.recipe.rules import Number, Table


class Ramp(Table):
    """A rate that changes evenly."""

    kind: Literal["ramp"]
    from_dps: Number
    to_dps: Number
    duration_s: Number = Field(gt=0, le=7200)

    @property
    def course(self) -> rate_course.Ramp:
        """The rate over time."""
        return rate_course.Ramp(self.from_dps, self.to_dps, self.duration_s)


class SineSweep(Table):
    """A sine whose frequency grows by the same factor in equal times; its size fades in and out."""

    kind: Literal["sine_sweep"]
    amplitude_dps: Number = Field(gt=0)
    from_hz: Number = Field(gt=0, le=500)
    to_hz: Number = Field(gt=0, le=500)
    duration_s: Number = Field(gt=0, le=7200)
    fade_s: Number = Field(default=2.0, ge=0)

    @property
    def course(self) -> rate_course.SineSweep:
        """The rate over time."""
        return rate_course.SineSweep(self.amplitude_dps, self.from_hz, self.to_hz, self.duration_s, self.fade_s)


Profile = Annotated[Ramp | SineSweep, Field(discriminator="kind")]
