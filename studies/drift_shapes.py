"""Coverage of U of the coefficients within one power-on, for drifts of several shapes.

Data-set means with the white noise and the drift of a truth are fitted by a model with a bias and a scale factor that
change with temperature. All true coefficients are 0. Stated is how often a coefficient is within two standard
uncertainties. None of the truths has just the time constants of the fit's own grid, and a random walk is not in it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.drift_noise import Scatter
from labctl.fitting.numeric.least_squares import solve

UNITS = int(os.environ.get("LABCTL_STUDY_UNITS", "400"))
SEED = 33_001
WHITE_DPS, DRIFT_DPS, STABILITY_DPS = 5e-4, 2e-3, 4e-3

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Schedule:
    """Data sets at all rates of one temperature after another."""

    levels_c: Array
    rates_dps: Array
    set_s: float
    soak_s: float

    def columns(self) -> tuple[Array, Array, Array]:
        """Return the design (m, 7), the times (m,) s and the rates (m,) deg/s."""
        warm = np.repeat(self.levels_c, len(self.rates_dps))
        rate = np.tile(self.rates_dps, len(self.levels_c))
        place = np.arange(len(warm))
        t_s = place * self.set_s + self.soak_s * (1 + place // len(self.rates_dps))
        x, r = (warm - 10.0) / 45.0, rate / 400.0
        return np.column_stack([np.ones_like(x), x, x**2, x**3, r, r * x, r * x**2]), t_s, rate


UP = np.linspace(-40.0, 50.0, 10)
SCHEDULES = {
    "10 temperatures, 21 rates, soaks of 1 h": Schedule(UP, np.linspace(-400, 400, 21), 75.0, 3600.0),
    "10 temperatures there and back, 6 rates, soaks of 1.5 h": Schedule(
        np.concatenate([UP, UP[::-1]]), np.array([-400.0, -200.0, -50.0, 50.0, 200.0, 400.0]), 75.0, 5400.0
    ),
    "5 temperatures, 9 rates, soaks of 15 min": Schedule(UP[::2], np.linspace(-400, 400, 9), 75.0, 900.0),
}
#: Time constants of the equal parts of a drift, s, and its size over `DRIFT_DPS`.
TRUTHS: dict[str, tuple[Sequence[float], float]] = {
    "one time constant, 300 s": ((300.0,), 1.0),
    "one time constant, 1 h": ((3600.0,), 1.0),
    "120, 700 and 3600 s": ((120.0, 700.0, 3600.0), 1.0),
    "flicker, 10 s to 28 h": (np.geomspace(10.0, 1e5, 9), 1.5),
    "random walk over 56 h": ((2e5,), 6.0),
}


def share_inside(
    schedule: Schedule, taus_s: Sequence[float], size: float, units: int, seed: int
) -> tuple[float, float]:
    """Return how many coefficients are within U, in percent, and half the interval of 95 %, by the units."""
    rng = np.random.default_rng(seed)
    design, t_s, rate_dps = schedule.columns()
    lag_s = np.abs(t_s[:, None] - t_s)
    covariance = (size * DRIFT_DPS) ** 2 * np.mean([np.exp(-lag_s / tau_s) for tau_s in taus_s], axis=0)
    factor = np.linalg.cholesky(covariance + WHITE_DPS**2 * np.eye(len(t_s)))
    run = np.zeros(len(t_s), dtype=np.int64)
    scatter = Scatter(t_s, run, rate_dps, np.full(len(t_s), WHITE_DPS**2), STABILITY_DPS)
    shares = []
    for _ in range(units):
        found = solve(design, factor @ rng.normal(size=len(t_s)), scatter)
        shares.append(np.mean(np.abs(found.values) <= 2 * np.sqrt(np.diag(found.covariance))))
    return 100 * float(np.mean(shares)), 196 * float(np.std(shares, ddof=1)) / np.sqrt(units)


def run(units: int = UNITS) -> str:
    """Return coverage by truth and schedule."""
    lines = [f"| {units} units a cell: within U, % | {' | '.join(SCHEDULES)} |", "| --- " * (len(SCHEDULES) + 1) + "|"]
    for name, truth in TRUTHS.items():
        cells = [share_inside(schedule, *truth, units, SEED) for schedule in SCHEDULES.values()]
        lines.append(f"| {name} | " + " | ".join(f"{share:.1f} ± {half:.1f}" for share, half in cells) + " |")
    return "\n".join(lines)
