"""The effect as a simulated unit has it: a film of water that grows faster in humid air."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden import HiddenEffect, State
from instruments.simulators.hidden.base import Array


class HumidityFilm(HiddenEffect):
    """A bias that rises with the humidity, slightly nonlinear."""

    id, unit, default = "humidity_sensitivity", "deg/s/%", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        """Return the addition, (n, 1) deg/s."""
        return (self.size * 40.0 * np.expm1((state.humidity_pct - 45.0) / 40.0))[:, None]
