"""Bias instability: a sum of Ornstein-Uhlenbeck processes on a grid of seconds, linear between grid points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRID_S = 1.0


class BiasInstability:
    """Bias of each axis at times that only rise. `sd_dps` is the standard deviation of the sum, `taus_s` its times."""

    def __init__(self, rng: np.random.Generator, sd_dps: float, taus_s: tuple[float, ...], axes: int) -> None:
        self._rng = rng
        self._taus_s = np.asarray(taus_s)
        self._sd_dps = sd_dps / np.sqrt(len(self._taus_s))
        self._axes = axes
        self._step = self._over(GRID_S)
        self._here = rng.normal(0.0, self._sd_dps, (len(self._taus_s), axes))
        self._next = self._here.copy()
        self._here_s = 0.0

    def sample(self, t_s: Array) -> Array:
        """Return the bias, (n, axes) deg/s, at rising times (n,)."""
        out = np.empty((len(t_s), self._axes))
        start = 0
        while start < len(t_s):
            if t_s[start] >= self._here_s + GRID_S:
                self._advance(float(t_s[start]))
            stop = int(np.searchsorted(t_s, self._here_s + GRID_S, side="left"))
            share = ((t_s[start:stop] - self._here_s) / GRID_S)[:, None]
            out[start:stop] = self._here.sum(0) * (1 - share) + self._next.sum(0) * share
            start = stop
        return out

    def _advance(self, t_s: float) -> None:
        skipped_s = max(np.floor((t_s - self._here_s) / GRID_S) - 1.0, 0.0) * GRID_S
        self._here = self._after(self._next, self._over(skipped_s)) if skipped_s else self._next
        self._here_s += skipped_s + GRID_S
        self._next = self._after(self._here, self._step)

    def _over(self, elapsed_s: float) -> tuple[Array, Array]:
        """Return what share of each process stays over a time, and the scatter that it gains, deg/s; (taus, 1) each."""
        keep = np.exp(-elapsed_s / self._taus_s)[:, None]
        return keep, self._sd_dps * np.sqrt(1 - keep**2)

    def _after(self, bias: Array, over: tuple[Array, Array]) -> Array:
        keep, scatter = over
        return keep * bias + scatter * self._rng.standard_normal(bias.shape)
