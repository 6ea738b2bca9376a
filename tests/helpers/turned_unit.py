"""A unit that a person turns from pose to pose, with known truth; numpy only, written apart from the fit.

The body turns about an axis that is fixed in it, from rest to rest with the least jerk; there is no Earth rate.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.live import PoseRequest

Array = NDArray[np.float64]
TURN_S, RATE_HZ = 2.0, 100.0


class TurnedUnit:
    """Readings of a unit, and the person who turns it to the pose that a live calibration asks for."""

    def __init__(self, seed: int, *, rest_s: float = 2.6) -> None:
        self._rng = rng = np.random.default_rng(seed)
        self.gyro = rng.normal(0, 0.01, (3, 3))  #: E of output = bias + (I + E) rate
        self.bias_dps = rng.normal(0, 1, 3)
        self.accel = np.triu(rng.normal(0, 0.01, (3, 3)))
        self.accel_bias_g = rng.normal(0, 0.02, 3)
        self._rest_s = rest_s
        self._n = 0
        self._up = np.array([0.1, 0.2, 0.97]) / np.linalg.norm([0.1, 0.2, 0.97])
        self._turn: tuple[float, Array, float, Array] | None = None  #: begins at, axis, angle, direction before
        self._rests_since_s = 0.0
        self._asked: Array | None = None

    def see(self, request: PoseRequest | None) -> None:
        """Read what is asked for; a hand does not meet it exactly."""
        self._asked = None if request is None else np.array(request.pose.up)

    def block(self, duration_s: float) -> dict[str, NDArray[np.generic]]:
        """Return the readings of the next seconds."""
        n = round(duration_s * RATE_HZ)
        t_s = (self._n + np.arange(n)) / RATE_HZ
        self._n += n
        rate, up = np.zeros((n, 3)), np.zeros((n, 3))
        for k, now in enumerate(t_s):
            rate[k], up[k] = self._motion(float(now))
        gyro = self.bias_dps + rate @ (np.eye(3) + self.gyro).T + self._rng.normal(0, 0.05, (n, 3))
        accel = self.accel_bias_g + up @ (np.eye(3) + self.accel).T + self._rng.normal(0, 0.002, (n, 3))
        found: dict[str, NDArray[np.generic]] = {"t_s": t_s}
        return found | columns_of("gyro_{}", gyro) | columns_of("accel_{}_g", accel)

    def _motion(self, t_s: float) -> tuple[Array, Array]:
        """Return rate, deg/s, and the direction that is up, both in the body."""
        if self._turn is None:
            if self._asked is None or t_s - self._rests_since_s < self._rest_s:
                return np.zeros(3), self._up
            self._begin(t_s, self._asked + self._rng.normal(0, 0.05, 3))
        assert self._turn is not None
        begin_s, axis, angle, before = self._turn
        u = min((t_s - begin_s) / TURN_S, 1.0)
        share, speed = u**3 * (10 - 15 * u + 6 * u**2), 30 * u**2 * (1 - u) ** 2 / TURN_S
        self._up = _rotated(before, axis, angle * share)
        if u >= 1.0:
            self._turn, self._rests_since_s = None, t_s
        return -np.degrees(angle * speed) * axis, self._up  # what is fixed outside turns backwards in the body

    def _begin(self, t_s: float, towards: Array) -> None:
        there = towards / np.linalg.norm(towards)
        axis = np.cross(self._up, there)
        angle = np.arctan2(np.linalg.norm(axis), self._up @ there)
        self._turn = (t_s, axis / np.linalg.norm(axis), float(angle), self._up)


def columns_of(name: str, values: Array) -> dict[str, NDArray[np.generic]]:
    """Return the columns (n,) of three axes."""
    return {name.format(axis): values[:, k] for k, axis in enumerate("xyz")}


def _rotated(vector: Array, axis: Array, angle: float) -> Array:
    cross = np.cross(axis, vector)
    return np.asarray(vector * np.cos(angle) + cross * np.sin(angle) + axis * (axis @ vector) * (1 - np.cos(angle)))
