"""Hidden effects of what came before: time, power-ons, re-mountings, the rate before this one."""

from __future__ import annotations

import numpy as np

from instruments.simulators.hidden.base import Array, HiddenEffect, State


class BiasDrift(HiddenEffect):
    """A bias that creeps with time, slower and slower; size per hour at first."""

    id, unit, default = "bias_drift", "deg/s/h", 1e-3

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        hours = state.t_s / 3600.0
        return (self.size * 200.0 * np.log1p(hours / 200.0))[:, None]


#: How far apart in the series of draws two sessions begin: the runs of one are not those of another.
PER_SESSION = 1031


class RunShift(HiddenEffect):
    """Another bias after every switching-on, of another day too; size is the standard deviation."""

    id, unit, default = "run_shift", "deg/s", 0.01

    def __init__(self, size: float, seed: list[int]) -> None:
        super().__init__(size, seed)
        self._shifts = self.rng.normal(0.0, 1.0, 4096)

    def number(self, state: State) -> int:
        """Return what the shift is counted by."""
        return state.run

    def error_dps(self, state: State, rate_dps: Array) -> Array:
        place = self.number(state) + PER_SESSION * state.session
        shift = self.size * self._shifts[place % len(self._shifts)]
        return np.full((len(state.t_s), 1), shift)


class MountingShift(RunShift):
    """Another bias after every re-mounting."""

    id = "mounting_shift"

    def number(self, state: State) -> int:
        return state.mounting


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
        own_dps = state.own_dps
        if self._followed is None:
            self._followed, self._at_s = own_dps[0].copy(), float(state.t_s[0])
        self._catch_up(state)
        steps = np.diff(np.concatenate([[self._at_s], state.t_s]))
        missing = np.empty_like(own_dps)
        for i, step in enumerate(steps):
            self._followed += (own_dps[i] - self._followed) * (1.0 - np.exp(-step / self.tau_s))
            missing[i] = own_dps[i] - self._followed
        self._at_s = float(state.t_s[-1])
        return -self.size * missing

    def _catch_up(self, state: State) -> None:
        """Follow the table through a gap between samples; twelve time constants back are enough."""
        gap_s = float(state.t_s[0]) - self._at_s
        if gap_s <= self.STEP_S or self._followed is None:
            return
        times = np.arange(max(self._at_s, float(state.t_s[0]) - 12 * self.tau_s), float(state.t_s[0]), self.STEP_S)
        for own_dps in state.own_at(times):
            self._followed += (own_dps - self._followed) * (1.0 - np.exp(-self.STEP_S / self.tau_s))
        self._at_s = float(times[-1])
