"""Motion of a table that follows a course of rates, and the encoder that reads it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class ProfileMotion:
    """Angle of a table whose rate is given at even times; at rest before and after."""

    def __init__(self, start_s: float, step_s: float, rates_dps: Array) -> None:
        """Take rates (k,), the first at `start_s`; both ends are 0, and steps are short against any change."""
        self._start_s, self._step_s, self._rates = start_s, step_s, rates_dps
        slope = np.gradient(rates_dps, step_s)
        # trapezoids with the first correction of Euler and Maclaurin
        parts = step_s * (rates_dps[1:] + rates_dps[:-1]) / 2 - step_s**2 / 12 * (slope[1:] - slope[:-1])
        self._angles = np.concatenate([[0.0], np.cumsum(parts)])
        self.end_s = start_s + step_s * (len(rates_dps) - 1)

    def angle_deg(self, t_s: Array) -> Array:
        """Return the angle at times (n,), degrees, by cubics that have the rates as their slopes."""
        at = np.clip((t_s - self._start_s) / self._step_s, 0.0, len(self._rates) - 1.0)
        k = np.minimum(at.astype(np.int64), len(self._rates) - 2)
        u = at - k
        first, second = self._step_s * self._rates[k], self._step_s * self._rates[k + 1]
        rise = self._angles[k + 1] - self._angles[k]
        bend = u * (1 - u) * ((1 - u) * (first - rise) + u * (rise - second))
        return np.asarray(self._angles[k] + u * rise + bend)

    def commanded_deg(self, t_s: Array) -> Array:
        """Return the angle that was asked for, degrees: a servo's is the true one."""
        return self.angle_deg(t_s)
