"""Hidden effects of gravity and of turning off the axis."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class GSensitivity(HiddenEffect):
    """A bias in proportion to the specific force along the axis, saturating far beyond 1 g."""

    id, unit, default = "g_sensitivity", "deg/s/g", 0.015

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * 20.0 * np.arctan(state.force_g[:, state.rows] / 20.0)


class CrossGSensitivity(HiddenEffect):
    """A bias from specific force across the axis."""

    id, unit, default = "cross_g_sensitivity", "deg/s/g", 0.015

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        across = np.stack(
            [state.force_g[:, (row + 1) % 3] - 0.6 * state.force_g[:, (row + 2) % 3] for row in state.rows], axis=1
        )
        return self.size * across


class GSquaredSensitivity(HiddenEffect):
    """A bias in proportion to the square of the specific force along the axis."""

    id, unit, default = "g_squared_sensitivity", "deg/s/g^2", 0.01

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        along = state.force_g[:, state.rows]
        return self.size * along * along


class CentripetalAcceleration(HiddenEffect):
    """The unit sits off the axis of rotation; size is the error at one g of centripetal acceleration.

    It is at 6 cm on a bench that does not state where it is.
    """

    id, unit, default = "centripetal_acceleration", "deg/s/g", 0.02
    usual_radius_m = 0.06

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        spin = np.deg2rad(state.table_dps)
        radius_m = self.usual_radius_m if state.radius_m is None else state.radius_m
        return (self.size * spin * spin * radius_m / 9.80665)[:, None]
