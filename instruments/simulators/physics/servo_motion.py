"""Motion of a servo table: rates that change with a constant acceleration, and sines of the rate."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from instruments.simulators.physics.oscillator import Sine, SineMotion

Array = NDArray[np.float64]

#: Corners in the history: a reading that is fetched late still gets the motion at its own time.
HISTORY = 64
#: Sines in the history.
SINES = 8


class ServoMotion:
    """Angle of a table whose rate is linear between corners, and constant after the last."""

    def __init__(self) -> None:
        self._t_s, self._angle, self._rate = [-1.0], [0.0], [0.0]
        self._sines: list[tuple[float, float, SineMotion]] = []  #: from, until, and the motion

    def set_rate(self, t_s: float, rate_dps: float, acceleration_dps2: float) -> float:
        """Change to a rate, from the present motion on; returns when it is reached."""
        angle, present = self._at(t_s)
        ramp_s = abs(rate_dps - present) / acceleration_dps2
        end = (t_s + ramp_s, angle + (present + rate_dps) / 2 * ramp_s, rate_dps)
        self._follow(t_s, [(t_s, angle, present), end])
        return t_s + ramp_s

    def move_to(self, t_s: float, angle_deg: float, rate_dps: float, acceleration_dps2: float) -> float:
        """Turn to an angle by the shorter way and stay there; returns when it is there."""
        begin_s = self.set_rate(t_s, 0.0, acceleration_dps2)
        present_deg, _ = self._at(begin_s)
        way = (angle_deg - present_deg + 180.0) % 360.0 - 180.0
        if way == 0:
            return begin_s
        top = math.copysign(min(rate_dps, math.sqrt(acceleration_dps2 * abs(way))), way)
        ramp_s = abs(top) / acceleration_dps2
        steady_s = abs(way / top) - ramp_s
        ramp_deg = top * ramp_s / 2
        corners = [
            (begin_s, present_deg, 0.0),
            (begin_s + ramp_s, present_deg + ramp_deg, top),
            (begin_s + ramp_s + steady_s, present_deg + way - ramp_deg, top),
            (begin_s + 2 * ramp_s + steady_s, present_deg + way, 0.0),
        ]
        self._follow(begin_s, corners)
        return corners[-1][0]

    def oscillate(self, sine: Sine) -> None:
        """Follow a sine of the rate, from the present angle on, until another motion begins."""
        angle, rate = self._at(sine.start_s)
        self._follow(sine.start_s, [(sine.start_s, angle, rate)])
        motion = SineMotion(sine, angle)
        self._sines = [*self._sines[1 - SINES :], (sine.start_s, math.inf, motion)]

    def sine(self) -> Sine | None:
        """Return the sine that is followed now."""
        return self._sines[-1][2].sine if self._sines and math.isinf(self._sines[-1][1]) else None

    def rate_dps(self, t_s: float) -> float:
        """Return the rate at one time, deg/s."""
        return self._at(t_s)[1]

    def moving(self, t_s: float) -> bool:
        """Return whether the table turns at a time, s."""
        sine = self.sine()
        if sine is not None and t_s >= sine.start_s:
            return bool(sine.sizes_dps(np.array([t_s]))[0])
        return self.rate_dps(t_s) != 0 or t_s < self._t_s[-1]

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle at times (n,), degrees, unwrapped."""
        corner_s = np.array(self._t_s)
        k = np.maximum(np.searchsorted(corner_s, t_s, side="right") - 1, 0)
        rate, angle = np.array(self._rate), np.array(self._angle)
        slope = np.append(np.diff(rate) / np.maximum(np.diff(corner_s), 1e-12), 0.0)
        since = t_s - corner_s[k]
        angles_deg = np.asarray(angle[k] + since * (rate[k] + 0.5 * slope[k] * since))
        for from_s, until_s, motion in self._sines:
            inside = (t_s >= from_s) & (t_s < until_s)
            if inside.any():
                angles_deg[inside] = motion.angle_deg(t_s[inside])
        return angles_deg

    def commanded_deg(self, t_s: Array) -> Array:
        """Return the angle of the encoder, degrees: a servo's is the true one."""
        return self.angle_deg(t_s)

    def _at(self, t_s: float) -> tuple[float, float]:
        """Return angle, deg, and rate, deg/s, at one time."""
        for from_s, until_s, motion in reversed(self._sines):
            if from_s <= t_s < until_s:
                now = np.array([t_s])
                return float(motion.angle_deg(now)[0]), float(motion.sine.rates_dps(now)[0])
        k = max(int(np.searchsorted(self._t_s, t_s, side="right")) - 1, 0)
        angle = float(self.angle_deg(np.array([t_s]))[0])
        if k + 1 == len(self._t_s):
            return angle, self._rate[k]
        share = (t_s - self._t_s[k]) / (self._t_s[k + 1] - self._t_s[k])
        return angle, self._rate[k] + max(share, 0.0) * (self._rate[k + 1] - self._rate[k])

    def _end_sine(self, t_s: float) -> None:
        """End the sine that is followed at a time, with a corner where it ends."""
        if not self._sines or self._sines[-1][1] < math.inf:
            return
        from_s, _, motion = self._sines[-1]
        now = np.array([t_s])
        end = (t_s, float(motion.angle_deg(now)[0]), float(motion.sine.rates_dps(now)[0]))
        self._sines[-1] = (from_s, t_s, motion)
        self._follow(t_s, [end])

    def _follow(self, t_s: float, corners: list[tuple[float, float, float]]) -> None:
        """Replace the corners at and after a time by others; corners at the same time become one."""
        self._end_sine(t_s)
        kept = [one for one in zip(self._t_s, self._angle, self._rate, strict=True) if one[0] < t_s]
        distinct = [one for one, after in pairwise(corners) if after[0] > one[0]]
        whole = [*kept, *distinct, corners[-1]][-HISTORY:]
        self._t_s, self._angle, self._rate = ([one[k] for one in whole] for k in range(3))
