"""What a model leaves near a rate and a temperature, and a later power-on, by data sets left out: NumPy only.

`docs/explanation/fitting.md` states both under *Uncertainty in use*, in numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.page_figures_recomputed import Sets
from studies.page_figures_refit import Refit

Array = np.ndarray
#: Width of a neighbourhood over the range, and the least of temperatures, K; factors by which it is widened in turn.
WIDTH, LEAST_WIDTH_K, WIDENED = 0.12, 0.5, (1.0, 1.5, 2.0, 3.0)
#: Data sets that it needs; farther than so many widths nothing is known; what could be seen, over its own uncertainty.
NEEDED, FARTHEST, SEEN = 3.0, 2.0, 0.25


@dataclass(frozen=True)
class Left:
    """What a fit leaves of each data set: variances (n, axes), and residuals about the mean of their power-on."""

    sets: Sets
    axes: tuple[str, ...]
    left_var: Array
    white_var: Array  #: (n, axes)
    inside_dps: Array  #: (n, axes), without the mean of each powered run
    run: Array
    run_means_dps: Array  #: (runs, axes) of what the fit leaves

    @staticmethod
    def of(refit: Refit) -> Left:
        """Multiply the residuals of the fit with those of fits without a data set's temperature, and without its rate.

        The two are averaged; where temperatures cannot be left out it is the latter alone.
        """
        run = next(iter(refit.means.values())).run
        inside = _within(refit.inside_dps, run)
        outside = [each for each in (refit.outside_temperature_dps, refit.outside_rate_dps) if each is not None]
        left = np.mean([inside * _within(each, run) for each in outside], axis=0)
        known = [np.zeros(len(run)) if each.white_var is None else each.white_var for each in refit.means.values()]
        means = np.array([refit.inside_dps[run == number].mean(axis=0) for number in np.unique(run)])
        return Left(refit.sets, refit.law.axes, left, np.column_stack(known), inside, run, means)

    @property
    def correlation(self) -> Array:
        """The correlation of the residuals of the outputs, (axes, axes)."""
        return np.atleast_2d(np.corrcoef(self.inside_dps.T))

    def repeatability(self) -> tuple[float, float] | None:
        """Return by how much a later power-on is off, deg/s, and its degrees of freedom; None: there was one only."""
        runs, axes = self.run_means_dps.shape
        if runs < 2:
            return None
        freedom = axes * (runs - 1)
        variance = np.sum((self.run_means_dps - self.run_means_dps.mean(axis=0)) ** 2) / freedom
        return float(np.sqrt(variance * (1 + 1 / runs))), float(freedom)

    def model(self, axis: str, rates_dps: Array, temperature_c: float) -> float:
        """Return what the model leaves of an output near a rate vector (3,), deg/s; NaN where it is not known."""
        about = "xyz".index(axis)
        variance = self._near(axis, {about: rates_dps[about]}, temperature_c)
        others = [k for k in range(3) if k != about and rates_dps[k]]
        if not others or np.isnan(variance):
            return float(np.sqrt(variance))
        at_rest = self._near(axis, {about: 0.0}, temperature_c)
        at_rest = variance if np.isnan(at_rest) else at_rest
        for k in others:
            if not np.any(self._turned(k)):
                return np.nan
            beyond = self._near(axis, {k: rates_dps[k], **{j: 0.0 for j in range(3) if j != k}}, temperature_c)
            variance += beyond - at_rest if np.isnan(beyond) else max(beyond - at_rest, 0.0)
        return float(np.sqrt(variance))

    def _turned(self, k: int) -> Array:
        """Return the data sets in which the table turned the unit about a body axis."""
        return np.array([up[-1] == "xyz"[k] for up in self.sets.position]) & (self.sets.table_rate_dps != 0)

    def _near(self, axis: str, rates_dps: dict[int, float], temperature_c: float) -> float:
        """Return the variance that is left near these rates, whatever the others are; NaN where it is not known."""
        column, warm = self.axes.index(axis), self.sets.temperature_c
        away = [(warm - temperature_c) / max(WIDTH * np.ptp(warm), LEAST_WIDTH_K)]
        away += [(self.sets.rate_dps[:, k] - at) / (WIDTH * np.ptp(self.sets.rate_dps[:, k]))
                 for k, at in rates_dps.items() if np.ptp(self.sets.rate_dps[:, k])]  # fmt: skip
        distance = np.linalg.norm(away, axis=0)
        for factor in WIDENED:
            weight = np.exp(-0.5 * (distance / factor) ** 2)
            number = weight.sum() ** 2 / np.sum(weight**2)
            if number >= NEEDED:
                break
        if distance.min() > FARTHEST or number < NEEDED:
            return np.nan
        left, noise = (weight @ each[:, column] / weight.sum() for each in (self.left_var, self.white_var))
        return float(max(left - noise, SEEN * np.sqrt(2 / number) * max(left, noise)))


def _within(values: Array, run: Array) -> Array:
    """Return values (n, axes) without the mean of each powered run, where there are several."""
    if len(np.unique(run)) < 2:
        return values
    return values - np.array([values[run == number].mean(axis=0) for number in run])
