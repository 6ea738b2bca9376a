"""Hidden effects that depend on the rate."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class Bias(HiddenEffect):
    """A constant output."""

    id, unit, default = "bias", "deg/s", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return np.full((len(state.t_s), 1), self.size)


class ScaleFactor(HiddenEffect):
    """A gain error."""

    id, unit, default = "scale_factor", "1", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * state.own_dps


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


class CrossAxisNonlinearity(HiddenEffect):
    """A bow from turning about the other axes."""

    id, unit, default = "cross_axis_nonlinearity", "(deg/s)^-1", 3e-7

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        full = state.full_scale_dps
        others = state.body_dps.sum(axis=1, keepdims=True) - state.own_dps
        return 2.0 * self.size * full**2 * (1.0 - np.cos(others / full))


class DeadBand(HiddenEffect):
    """Lock-in: no output below a threshold, the root law of coupled beams above it; size is the threshold."""

    id, unit, default = "dead_band", "deg/s", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        own = state.own_dps
        passed = np.sign(own) * np.sqrt(np.maximum(own * own - self.size**2, 0.0))
        return passed - own


class Quantization(HiddenEffect):
    """A coarse converter; size is its step."""

    id, unit, default = "quantization", "deg/s", 0.05

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        return self.size * np.floor(rate_dps / self.size + 0.5) - rate_dps


class VibrationRectification(HiddenEffect):
    """A resonance of the table: a Lorentzian over the logarithm of the rate."""

    id, unit, default = "vibration_rectification", "deg/s", 0.01

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        ratio = np.log(np.maximum(np.abs(state.table_dps), 1e-3) / (0.27 * state.full_scale_dps)) / 0.4
        return (self.size / (1.0 + ratio * ratio))[:, None]


class RateHysteresis(HiddenEffect):
    """A memory of the rate before this one, saturating."""

    id, unit, default = "rate_hysteresis", "deg/s", 0.005

    def __init__(self, size: float, seed: list[int]) -> None:
        super().__init__(size, seed)
        self._now = self._before = 0.0

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        mean = float(np.mean(state.table_dps)) if len(state.t_s) else self._now
        if abs(mean - self._now) > max(0.02 * abs(self._now), 0.05):
            self._before, self._now = self._now, mean
        return np.full((len(state.t_s), 1), self.size * np.tanh(3.0 * self._before / state.full_scale_dps))


class StartTransient(HiddenEffect):
    """The output creeps to a new rate; size is the share that is missing at first."""

    id, unit, default = "start_transient", "1", 1e-3
    tau_s = 4.3
    STEP_S = 0.5

    def __init__(self, size: float, seed: list[int]) -> None:
        super().__init__(size, seed)
        self._followed: Array | None = None
        self._at_s = 0.0

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        own = state.own_dps
        if self._followed is None:
            self._followed, self._at_s = own[0].copy(), float(state.t_s[0])
        self._catch_up(state)
        steps = np.diff(np.concatenate([[self._at_s], state.t_s]))
        missing = np.empty_like(own)
        for i, step in enumerate(steps):
            self._followed += (own[i] - self._followed) * (1.0 - np.exp(-step / self.tau_s))
            missing[i] = own[i] - self._followed
        self._at_s = float(state.t_s[-1])
        return -self.size * missing

    def _catch_up(self, state: State) -> None:
        """Follow the table through a gap between samples; twelve time constants back are enough."""
        gap_s = float(state.t_s[0]) - self._at_s
        if gap_s <= self.STEP_S or self._followed is None:
            return
        times = np.arange(max(self._at_s, float(state.t_s[0]) - 12 * self.tau_s), float(state.t_s[0]), self.STEP_S)
        for own in state.own_at(times):
            self._followed += (own - self._followed) * (1.0 - np.exp(-self.STEP_S / self.tau_s))
        self._at_s = float(times[-1])


EFFECTS: tuple[type[HiddenEffect], ...] = (
    Bias,
    ScaleFactor,
    ScaleFactorAsymmetry,
    ScaleFactorEven,
    ScaleFactorOdd,
    SineResponse,
    Saturation,
    Misalignment,
    NonOrthogonality,
    CrossAxisNonlinearity,
    DeadBand,
    Quantization,
    VibrationRectification,
    RateHysteresis,
    StartTransient,
)
