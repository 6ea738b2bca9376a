"""Table kinematics: finite moves of whole steps with linear ramps, and the small errors of steps and gears."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Half steps of one electrical cycle of the motor: four full steps.
ELECTRICAL_CYCLE_STEPS = 8
#: Moves in the history: a reading that is fetched late still gets the motion at its own time.
HISTORY_MOVES = 16


@dataclass(frozen=True)
class Move:
    """A trapezoid of whole steps: ramp up, cruise, ramp down."""

    start_s: float
    from_steps: float
    direction: int
    steps: float
    rate_hz: float
    acceleration_hz_s: float
    counts_from_s: float | None = None  #: a tail that replaces the end of another move counts from here

    @property
    def from_s(self) -> float:
        """Time from which this move gives the position of the table, s."""
        return self.start_s if self.counts_from_s is None else self.counts_from_s

    @property
    def ramp_s(self) -> float:
        """Duration of each ramp, s."""
        return self.rate_hz / self.acceleration_hz_s

    @property
    def end_s(self) -> float:
        """Time at which the table is at rest again, s."""
        if self.steps == 0:  # a place to stand at, without ramps
            return self.start_s
        ramps = self.rate_hz**2 / self.acceleration_hz_s
        return self.start_s + 2 * self.ramp_s + (self.steps - ramps) / self.rate_hz

    def position(self, t_s: Array) -> Array:
        """Return the commanded position, (n,) steps, at times (n,)."""
        a, f, tr = self.acceleration_hz_s, self.rate_hz, self.ramp_s
        t = np.clip(t_s - self.start_s, 0.0, self.end_s - self.start_s)
        left = (self.end_s - self.start_s) - t
        travelled = np.where(
            t < tr,
            0.5 * a * t * t,
            np.where(left < tr, self.steps - 0.5 * a * left * left, 0.5 * f * tr + f * (t - tr)),
        )
        return self.from_steps + self.direction * travelled

    def rate(self, t_s: float) -> float:
        """Return the commanded step rate at one time, steps per second, without sign."""
        t, left = t_s - self.start_s, self.end_s - t_s
        if t <= 0 or left <= 0:
            return 0.0
        return min(self.acceleration_hz_s * t, self.rate_hz, self.acceleration_hz_s * left)


def trapezoid(start_s: float, from_steps: float, steps: int, rate_hz: float, acceleration_hz_s: float) -> Move:
    """Return a move of `steps` (signed); a short one never reaches the full rate."""
    size = abs(steps)
    reached = min(rate_hz, math.sqrt(acceleration_hz_s * size)) if size else rate_hz
    return Move(start_s, from_steps, 1 if steps >= 0 else -1, float(size), reached, acceleration_hz_s)


class TableMotion:
    """Commanded and true motion of the table."""

    def __init__(self, steps_per_turn: int, *, step_error_deg: float = 0.0225, gear_error_deg: float = 0.0) -> None:
        self.step_deg = 360.0 / steps_per_turn
        self._steps_per_turn = steps_per_turn
        self._step_error_deg = step_error_deg
        self._gear_error_deg = gear_error_deg
        self._moves = [Move(-1.0, 0.0, 1, 0.0, 1.0, 1.0)]

    def start(self, t_s: float, steps: int, step_rate_hz: float, acceleration_dps2: float) -> float:
        """Begin a move of whole steps (signed) at a time, s; returns the time of its end."""
        from_steps = float(self._moves[-1].position(np.array([t_s]))[0])
        move = trapezoid(t_s, from_steps, steps, step_rate_hz, acceleration_dps2 / self.step_deg)
        self._moves = [*self._moves[1 - HISTORY_MOVES :], move]
        return move.end_s

    def abort(self, t_s: float) -> float:
        """Ramp down from the present rate; returns the time at which the table is at rest.

        A move that is to begin later does not begin.
        """
        index = self._in_force(t_s)
        move = self._moves[index]
        rate, position_steps = move.rate(t_s), float(move.position(np.array([t_s]))[0])
        if rate > 0:
            # The rest of the move is replaced by the down ramp of a move that cruises at the present rate.
            ramp_steps = rate**2 / (2 * move.acceleration_hz_s)
            begun = t_s - rate / move.acceleration_hz_s
            from_steps = position_steps - move.direction * ramp_steps
            last = Move(begun, from_steps, move.direction, 2 * ramp_steps, rate, move.acceleration_hz_s, t_s)
        elif self.moving(t_s):
            last = Move(t_s, position_steps, 1, 0.0, 1.0, 1.0)
        else:
            return t_s
        self._moves = [*self._moves[: index + 1][1 - HISTORY_MOVES :], last]
        return max(last.end_s, t_s)

    def home(self, t_s: float) -> float:
        """Turn back to the home switch by the shorter way at a tenth of a turn per second; returns when it is there."""
        position_steps = float(self._moves[-1].position(np.array([t_s]))[0])
        away = position_steps - self._steps_per_turn * round(position_steps / self._steps_per_turn)
        back = Move(t_s, position_steps, -1 if away > 0 else 1, abs(away), 0.1 * self._steps_per_turn, 1e6)
        settled = Move(back.end_s, 0.0, 1, 0.0, 1.0, 1.0)
        self._moves = [back, settled] if away else [settled]
        return back.end_s

    def moving(self, t_s: float) -> bool:
        """Return whether the table turns at a time, s, or is about to."""
        return any(move.steps > 0 and t_s < move.end_s for move in self._moves[self._in_force(t_s) :])

    def _in_force(self, t_s: float) -> int:
        """Return which move gives the position at a time: the last one that counts by then."""
        begun = (index for index in range(len(self._moves) - 1, 0, -1) if self._moves[index].from_s <= t_s)
        return next(begun, 0)

    def commanded_deg(self, t_s: Array) -> Array:
        """Return the commanded angle, (n,) degrees, unwrapped since home."""
        return self._steps(t_s) * self.step_deg

    def angle_deg(self, t_s: Array) -> Array:
        """Return the true angle, (n,) degrees: the commanded angle plus the errors of steps and gear."""
        steps = self._steps(t_s)
        angle = steps * self.step_deg
        if self._step_error_deg:
            angle = angle + self._step_error_deg * np.sin(2 * np.pi * steps / ELECTRICAL_CYCLE_STEPS)
        if self._gear_error_deg:
            angle = angle + self._gear_error_deg * np.sin(2 * np.pi * steps * 4 / self._steps_per_turn + 0.7)
        return angle

    def _steps(self, t_s: Array) -> Array:
        last = self._moves[-1]
        if len(t_s) and t_s[0] >= last.from_s:
            return last.position(t_s)
        which = np.searchsorted([move.from_s for move in self._moves[1:]], t_s, side="right")
        steps = np.empty(len(t_s))
        for index in np.unique(which):
            rows = which == index
            steps[rows] = self._moves[index].position(t_s[rows])
        return steps
