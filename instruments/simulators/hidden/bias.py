"""Hidden effects on the bias: a constant, and its change with temperature."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class Bias(HiddenEffect):
    """A constant output."""

    id, unit, default = "bias", "deg/s", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return np.full((len(state.t_s), 1), self.size)


class BiasTemperature(HiddenEffect):
    """A bias that is a nonlinear function of temperature."""

    id, unit, default = "bias_temperature", "deg/s/K", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (self.size * 60.0 * np.sinh((state.sensor_c - 25.0) / 60.0))[:, None]


class OutsideEtalon(HiddenEffect):
    """No effect of the catalogue: a ripple over temperature, as from a parasitic reflection."""

    id, unit, default = "outside_etalon", "deg/s", 0.01

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (self.size * np.sin(2 * np.pi * state.sensor_c / 13.0 + 0.4))[:, None]
