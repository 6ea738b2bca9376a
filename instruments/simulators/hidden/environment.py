"""Hidden effects of the surroundings: supply voltage and humidity."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class SupplySensitivity(HiddenEffect):
    """A bias that follows the supply voltage."""

    id, unit, default = "supply_sensitivity", "deg/s/V", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (self.size * state.supply_wander_v)[:, None]


class OutsideHumidity(HiddenEffect):
    """No effect of the catalogue: the bias jumps where the relative humidity passes a value."""

    id, unit, default = "outside_humidity", "deg/s", 0.01

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (0.5 * self.size * np.tanh((state.humidity_pct - 46.0) / 0.8))[:, None]
