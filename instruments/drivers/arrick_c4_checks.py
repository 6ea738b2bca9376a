"""What an open-loop table finds out about its own steps: the true step rate, and steps missed since home.

The C4 tells no position. The homing starts where the table is, so its duration says how far home is from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from instruments.clock import Clock
from instruments.errors import NoReply, WrongInstrument
from instruments.interfaces.table import HomeCheck, StepClock, Wait
from instruments.protocols.arrick_c4_moves import Move, TimedRun, step_rate_hz
from instruments.protocols.arrick_c4_settings import ArrickC4Settings

#: A clock that is further off has other settings, or the motor stands.
LARGEST_DEVIATION = 0.2
#: Share of a table's turn that the homing is measured over, and its rate, deg/s.
LEARNING_TURN, SLOW_DPS = 16, 22.5
POLL_S = 0.5
NO_SPEED = (
    "no constant rate: the C4's speed command is not public; set speed_template of the table in the bench file from "
    "your "
    "controller's manual"
)


def measured_clock(
    device: str, settings: ArrickC4Settings, nominal_hz: float, runs: tuple[TimedRun, TimedRun]
) -> StepClock:
    """Return the step clock by two runs at a nominal step rate.

    Raises WrongInstrument for a rate that no clock error explains.
    """
    short, long = runs
    ratio = step_rate_hz(short, long) / nominal_hz if long.duration_s > short.duration_s else math.inf
    if abs(ratio - 1) > LARGEST_DEVIATION:
        raise WrongInstrument(
            device,
            f"the motor steps at {100 * ratio:.4g} % of the rate that the bench file gives, limit "
            f"+-{100 * LARGEST_DEVIATION:g} % from 100 %; check step_clock_hz, speed_template and that the motor turns",
        )
    u_s = 2 * settings.reply_u_s  # of four replies; what all of them have in common cancels
    return StepClock(
        ratio, 1e6 * u_s / (long.duration_s - short.duration_s), settings.step_clock_hz, settings.clock_u_ppm
    )


def timed(clock: Clock, move: Move, await_end: Callable[[float], None], wait: Wait, start_s: float) -> TimedRun:
    """Return a move with its true duration; `await_end` waits for its end for some seconds, or raises NoReply."""
    earliest_s = start_s + (1 - LARGEST_DEVIATION) * move.duration_s
    latest_s = start_s + (1 + 2 * LARGEST_DEVIATION) * move.duration_s + POLL_S
    wait(max(earliest_s - clock.now_s(), 0.0))
    while True:
        try:
            await_end(POLL_S)
            break
        except NoReply:
            if clock.now_s() >= latest_s:
                raise
            wait(0.0)
    return TimedRun(move.steps, clock.now_s() - start_s)


@dataclass
class Homing:
    """How long the homing takes from the place that is home, and longer for each step away from it."""

    from_home_s: float
    step_s: float

    def missed(self, took_s: float, settings: ArrickC4Settings) -> HomeCheck:
        """Return how many steps away from home a homing began."""
        steps = max(took_s - self.from_home_s, 0.0) / self.step_s
        return HomeCheck(float(round(steps)), settings.home_limit_steps, 360.0 / settings.steps_per_turn)
