"""Units that a person turns from pose to pose: their attitude, and the rates that they feel meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: How well a hand meets a pose, deg of each of two tilts, and how long it waits before it tries the same pose again, s.
POSE_U_DEG, AGAIN_AFTER_S = 3.0, 12.0
#: Least duration of a turn, s.
SHORTEST_S = 0.5


def rotations(axis: Array, angles_rad: Array) -> Array:
    """Return the matrices (n, 3, 3) of turns by angles (n,) about an axis (3,) of length 1."""
    skew = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    sine, cosine = np.sin(angles_rad)[:, None, None], np.cos(angles_rad)[:, None, None]
    return np.asarray(cosine * np.eye(3) + sine * skew + (1.0 - cosine) * np.outer(axis, axis))


def between(first: Array, second: Array) -> tuple[Array, float]:
    """Return the axis (3,) and the angle, rad, of the shortest turn from one direction (3,) to another."""
    axis = np.asarray(np.cross(first, second), dtype=np.float64)
    size = float(np.linalg.norm(axis))
    if size < 1e-9:  # opposite or equal: any axis square to it
        axis = np.asarray(np.cross(first, np.eye(3)[int(np.argmin(np.abs(first)))]), dtype=np.float64)
        size_of_any = float(np.linalg.norm(axis))
        return np.asarray(axis / size_of_any, dtype=np.float64), 0.0 if float(first @ second) > 0 else float(np.pi)
    return np.asarray(axis / size, dtype=np.float64), float(np.arctan2(size, first @ second))


@dataclass(frozen=True)
class _Turn:
    """A turn about an axis of the body, from rest to rest with the least jerk."""

    start_s: float
    duration_s: float
    axis: Array  #: (3,) in the body
    angle_rad: float
    before: Array  #: (3, 3) from body to laboratory

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s

    def angles(self, t_s: Array) -> Array:
        """Return how far it has come at times (n,), rad."""
        u = np.clip((t_s - self.start_s) / self.duration_s, 0.0, 1.0)
        return np.asarray(self.angle_rad * u**3 * (10.0 + u * (6.0 * u - 15.0)))

    def attitudes(self, t_s: Array) -> Array:
        """Return the attitude at times (n,), (n, 3, 3) from body to laboratory."""
        return np.asarray(self.before @ rotations(self.axis, self.angles(t_s)))


class Tumbling:
    """The turns so far; at first the units lie with `up` (3,) pointing up."""

    def __init__(self, up: Sequence[float], rate_dps: float, reaction_s: float, seed: Sequence[int]) -> None:
        axis, angle = between(np.asarray(up, dtype=np.float64), np.array([0.0, 0.0, 1.0]))
        self._first = rotations(axis, np.array([angle]))[0]
        self._rate_dps, self._reaction_s = rate_dps, reaction_s
        self._rng = np.random.default_rng(seed)
        self._turns: list[_Turn] = []
        self._asked: tuple[float, ...] = ()

    def lay(self, t_s: float, up: Sequence[float]) -> None:
        """Make the person lay the units down with direction `up` (3,) of the body pointing up.

        A person who still turns them, or has just met this pose, does nothing.
        """
        idle_s = t_s - (self._turns[-1].end_s if self._turns else -np.inf)
        if idle_s < 0 or (tuple(up) == self._asked and idle_s < AGAIN_AFTER_S):
            return
        self._asked = tuple(up)
        before = self._turns[-1].attitudes(np.array([t_s]))[0] if self._turns else self._first
        up_at_rest = np.asarray(up, dtype=np.float64) + np.radians(POSE_U_DEG) * self._rng.standard_normal(3)
        axis, angle = between(before[2], up_at_rest / np.linalg.norm(up_at_rest))
        duration_s = max(float(np.degrees(angle)) / self._rate_dps, SHORTEST_S)
        # what is up stays up in the laboratory: seen from the body it moves the other way round
        self._turns.append(_Turn(t_s + self._reaction_s, duration_s, -axis, angle, before))

    def attitudes(self, t_s: Array) -> Array:
        """Return the attitude at rising times (n,), (n, 3, 3) from body to laboratory."""
        attitude = np.broadcast_to(self._first, (len(t_s), 3, 3)).copy()
        for turn in self._turns:
            since = t_s >= turn.start_s
            attitude[since] = turn.attitudes(t_s[since])
        return attitude

    def rates_dps(self, t_s: Array, period_s: float) -> Array:
        """Return the mean rate of the body over the periods that end at times (n,), (n, 3) deg/s in body axes."""
        rates = np.zeros((len(t_s), 3))
        for turn in self._turns:
            come = turn.angles(t_s) - turn.angles(t_s - period_s)
            rates += np.degrees(come / period_s)[:, None] * turn.axis
        return rates
