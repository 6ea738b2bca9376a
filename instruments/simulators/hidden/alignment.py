"""Hidden tilts of the input axes."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class Misalignment(HiddenEffect):
    """An input axis tilted towards the two others."""

    id, unit, default = "misalignment", "1", 0.002

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        others = state.body_dps.sum(axis=1, keepdims=True) - state.own_dps
        return np.tan(self.size) * others


class NonOrthogonality(Misalignment):
    """Axes that are not square: each leans to the next one only."""

    id = "non_orthogonality"

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return np.sin(self.size) * np.stack([state.body_dps[:, (row + 1) % 3] for row in state.rows], axis=1)
