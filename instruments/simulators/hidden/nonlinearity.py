"""Hidden effects with a shape over the rate that is no polynomial: other axes, resonance, dead band, steps."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class CrossAxisNonlinearity(HiddenEffect):
    """A bow from turning about the other axes."""

    id, unit, default = "cross_axis_nonlinearity", "(deg/s)^-1", 3e-7

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        full = state.full_scale_dps
        others = state.body_dps.sum(axis=1, keepdims=True) - state.own_dps
        return 2.0 * self.size * full**2 * (1.0 - np.cos(others / full))


class VibrationRectification(HiddenEffect):
    """A resonance of the table: a Lorentzian over the logarithm of the rate."""

    id, unit, default = "vibration_rectification", "deg/s", 0.01

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        ratio = np.log(np.maximum(np.abs(state.table_dps), 1e-3) / (0.27 * state.full_scale_dps)) / 0.4
        return (self.size / (1.0 + ratio * ratio))[:, None]


class DeadBand(HiddenEffect):
    """Lock-in: no output below a threshold, the root law of coupled beams above it; size is the threshold."""

    id, unit, default = "dead_band", "deg/s", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        own_dps = state.own_dps
        passed = np.sign(own_dps) * np.sqrt(np.maximum(own_dps * own_dps - self.size**2, 0.0))
        return passed - own_dps


class Quantization(HiddenEffect):
    """A coarse converter; size is its step."""

    id, unit, default = "quantization", "deg/s", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * np.floor(rate_dps / self.size + 0.5) - rate_dps
