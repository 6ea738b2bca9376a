"""Hidden effects of the Earth, of magnets around the bench, and of the rate table."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class EarthRate(HiddenEffect):
    """A world at another latitude: an additional rate along the table axis."""

    id, unit, default = "earth_rate", "deg/s", 0.0028

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * state.g[:, state.rows]


class OncePerTurn(HiddenEffect):
    """An error that repeats once per turn of the table."""

    phase_deg = 0.0

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (self.size * np.cos(np.radians(state.angle_deg - self.phase_deg)))[:, None]


class EarthRateTilt(OncePerTurn):
    """A tilted axis feels the horizontal Earth rate, once per turn, with its phase to the north."""

    id, unit, default = "earth_rate_tilt", "deg/s", 0.003

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return (self.size * np.cos(np.radians(state.angle_deg - state.north_deg)))[:, None]


class MagneticSensitivity(OncePerTurn):
    """The magnetic field around the bench, with a small quadratic part."""

    id, unit, default = "magnetic_sensitivity", "deg/s", 0.003
    phase_deg = 71.0

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        heading = np.radians(state.angle_deg - self.phase_deg)
        return (self.size * (np.cos(heading) + 0.05 * np.cos(heading) ** 2))[:, None]


class TableTilt(OncePerTurn):
    """A table out of level: gravity varies once per turn, and the bearing twice per turn."""

    id, unit, default = "table_tilt", "deg/s", 0.003
    phase_deg = 140.0

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        heading = np.radians(state.angle_deg - self.phase_deg)
        return (self.size * (np.cos(heading) + 0.3 * np.sin(2 * heading)))[:, None]


class TableRateRatio(HiddenEffect):
    """A table that turns faster than its step count gives."""

    id, unit, default = "table_rate_ratio", "1", 1e-4

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * state.own_dps


class TableRateRipple(HiddenEffect):
    """A gear that is not round: four times per turn of the table; size relative to the rate."""

    id, unit, default = "table_rate_ripple", "1", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * state.own_dps * np.cos(4 * np.radians(state.angle_deg) + 0.9)[:, None]


class MissedSteps(HiddenEffect):
    """A motor that loses steps above four fifths of full scale; size is the share lost."""

    id, unit, default = "missed_steps", "1", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        fast = 0.5 * (1.0 + np.tanh((np.abs(state.table_dps) / state.full_scale_dps - 0.7) / 0.01))
        return -self.size * state.own_dps * fast[:, None]
