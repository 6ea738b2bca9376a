"""Constant rates of the Arrick C4: one finite move of whole steps at a whole divisor of the step clock."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from instruments.protocols.arrick_c4_settings import StepperSettings

#: Steady time beyond the requested time, s: a gate that starts and ends on step edges always fits.
SPARE_S = 0.5


@dataclass(frozen=True)
class Move:
    """One finite move: linear ramp up, constant step rate, linear ramp down."""

    divisor: int  #: of the step clock
    step_hz: float  #: step rate of the steady part, steps/s
    steps: int  #: signed, of the whole move
    ramp_s: float  #: duration of each ramp
    ramp_steps: float  #: steps of each ramp
    steady_s: float  #: duration of the steady part

    @property
    def duration_s(self) -> float:
        """Time from the start to rest, s."""
        return self.steady_s + 2 * self.ramp_s


def finite_move(settings: StepperSettings, rate_dps: float, steps: int) -> Move:
    """Return a move of exactly `steps` (signed, not 0) at the nearest achievable rate; a short one stays below it."""
    usual = plan_move(settings, rate_dps, 0.0)
    steady = max(abs(steps) - 2 * usual.ramp_steps, 0.0) / usual.step_hz
    return replace(usual, steps=steps, steady_s=steady)


def plan_move(settings: StepperSettings, rate_dps: float, steady_s: float) -> Move:
    """Return the move at the nearest achievable rate that stays steady for at least `steady_s` seconds.

    `rate_dps` is in deg/s and not 0; its sign is the sign of the steps.
    """
    step_deg = 360.0 / settings.steps_per_turn
    divisor = max(round(settings.step_clock_hz * step_deg / abs(rate_dps)), 1)
    step_hz = settings.step_clock_hz / divisor
    acceleration = settings.acceleration_dps2 / step_deg
    ramp_steps = step_hz**2 / (2 * acceleration)
    steps = math.ceil(2 * ramp_steps + step_hz * (steady_s + SPARE_S)) + 1
    steady = (steps - 2 * ramp_steps) / step_hz
    return Move(divisor, step_hz, int(math.copysign(steps, rate_dps)), step_hz / acceleration, ramp_steps, steady)
