"""Hidden effects of changing temperature: rate of change, lag, hysteresis, warm-up, thermometer."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class TemperatureRate(HiddenEffect):
    """A Shupe-type error: while the coil warms or cools, and less than in proportion when it does so fast."""

    id, unit, default = "temperature_rate", "deg/s/(K/min)", 0.02

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        rate = state.sensor_k_min
        return (self.size * rate / np.sqrt(1.0 + (rate / 5.0) ** 2))[:, None]


class ThermalLag(HiddenEffect):
    """A bias that follows a part which the thermometer does not touch; size per K of the difference."""

    id, unit, default = "thermal_lag", "deg/s/K", 0.005

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (self.size * (state.deep_c - state.sensor_c))[:, None]


class ThermalHysteresis(HiddenEffect):
    """A bias that depends on whether the temperature was approached from below, turning over within some kelvins."""

    id, unit, default = "thermal_hysteresis", "deg/s", 0.005

    def __init__(self, size: float, seed: list[int]) -> None:
        super().__init__(size, seed)
        self._play_c: float | None = None

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        width = 4.0
        side = np.empty(len(state.t_s))
        for i, temperature in enumerate(state.sensor_c):
            play = state.start_c if self._play_c is None else self._play_c
            self._play_c = min(max(play, temperature - width), temperature + width)
            side[i] = (temperature - self._play_c) / width
        return (self.size * side)[:, None]


class WarmUp(HiddenEffect):
    """A turn-on transient of two time constants."""

    id, unit, default = "warm_up", "deg/s", 0.03

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        on = np.maximum(state.on_s, 0.0)
        return (self.size * (0.7 * np.exp(-on / 2700.0) + 0.3 * np.exp(-on / 700.0)))[:, None]


class SelfHeating(HiddenEffect):
    """The die is warmer than its thermometer says, more and more after power-on; size in kelvins."""

    id, unit, default = "self_heating", "K", 2.0

    def thermometer_c(self, state: State) -> Array:
        return -self.size * -np.expm1(-np.maximum(state.on_s, 0.0) / 1300.0)


class ThermometerError(HiddenEffect):
    """A thermometer that is off, a little more where it is warm."""

    id, unit, default = "thermometer_error", "K", 0.5

    def thermometer_c(self, state: State) -> Array:
        return self.size * (1.0 + 0.1 * np.tanh((state.sensor_c - 25.0) / 40.0))
