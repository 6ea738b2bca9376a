"""Hidden effects on the scale factor: its error, its shape over the rate, its change with temperature."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class ScaleFactor(HiddenEffect):
    """A gain error."""

    id, unit, default = "scale_factor", "1", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * state.own_dps


class ScaleFactorTemperature(HiddenEffect):
    """A gain that follows temperature."""

    id, unit, default = "scale_factor_temperature", "1/K", 3e-5

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return state.own_dps * np.expm1(self.size * (state.sensor_c - 25.0))[:, None]


class ScaleFactorLag(HiddenEffect):
    """A gain that follows a part which the thermometer does not touch; size per K of the difference."""

    id, unit, default = "scale_factor_lag", "1/K", 2e-4

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return state.own_dps * np.expm1(self.size * (state.deep_c - state.sensor_c))[:, None]


class ScaleFactorAsymmetry(HiddenEffect):
    """Gains that differ by direction, joined smoothly through rest."""

    id, unit, default = "scale_factor_asymmetry", "1", 1e-4

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        soft = 0.002 * state.full_scale_dps
        return self.size * (np.hypot(state.own_dps, soft) - soft)


class ScaleFactorEven(HiddenEffect):
    """A bow that is the same for both directions, flattening a little at the ends."""

    id, unit, default = "scale_factor_even", "(deg/s)^-1", 3e-7

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        full = state.full_scale_dps
        return 2.0 * self.size * full**2 * (1.0 - np.cos(state.own_dps / full))


class ScaleFactorOdd(HiddenEffect):
    """A bend of opposite sign for the two directions."""

    id, unit, default = "scale_factor_odd", "(deg/s)^-2", 2e-9

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        full = state.full_scale_dps
        return 6.0 * self.size * full**3 * (state.own_dps / full - np.sin(state.own_dps / full))


class SineResponse(HiddenEffect):
    """An open-loop interferometer: the fringe's sine by its product formula; size is k in s/rad."""

    id, unit, default = "sine_response", "s/rad", 0.1

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        phase = self.size * np.deg2rad(state.own_dps)
        third = phase / 3.0
        sine = 3.0 * np.sin(third) - 4.0 * np.sin(third) * np.sin(third) * np.sin(third)
        return np.rad2deg(sine / self.size) - state.own_dps


class Saturation(HiddenEffect):
    """A soft clip above nine tenths of full scale; size is the share that is lost beyond it, negative."""

    id, unit, default = "saturation", "1", -0.01

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        knee, soft = 0.83 * state.full_scale_dps, 0.03 * state.full_scale_dps
        excess = (np.abs(state.own_dps) - knee) / soft
        return self.size * np.sign(state.own_dps) * soft * np.logaddexp(0.0, excess)
