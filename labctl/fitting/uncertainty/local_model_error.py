"""Error of a model near one rate and temperature: the variance that it leaves beyond the readings' own noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.fitting.numeric.arrays import Array

#: Width of the neighbourhood, as a share of the range of rates and of temperatures (standard deviation of the weight).
NEAR_SHARE = 0.12
#: Data sets, weighted, that a neighbourhood needs.
LEAST_NEAR = 3.0
#: Farther than this many widths from every data set nothing is known.
FARTHEST = 2.0
#: The least variance that is stated, as a share of the standard uncertainty of the estimate itself: a smaller one could
#: not be seen.
LEAST_SHARE = 0.25
#: Data sets beyond this many are averaged in groups of neighbours, of temperatures in so many groups.
MOST_KEPT, TEMPERATURES = 2000, 10


@dataclass(frozen=True)
class LocalModelError:
    """Data sets of one axis, (m,) each: where they were, the variance left there, and that of the readings' noise."""

    rate_dps: Array
    temperature_c: Array
    left_var: Array  #: (deg/s)^2, NaN where it is not known
    white_var: Array  #: (deg/s)^2

    def at(self, rate_dps: float, temperature_c: float) -> float | None:
        """Return the standard error of the model there, deg/s, drift of the campaign included; None if unknown."""
        if self.unknown_at(rate_dps, temperature_c) is not None:
            return None
        known = np.isfinite(self.left_var)
        weight = np.exp(-0.5 * self._away(rate_dps, temperature_c) ** 2)
        near = _effective_number(weight)
        weight /= weight.sum()
        left = float(weight @ self.left_var[known])
        noise = float(weight @ self.white_var[known])
        unseen = LEAST_SHARE * np.sqrt(2 / near) * max(left, noise)
        return float(np.sqrt(max(left - noise, unseen)))

    def thinned(self) -> LocalModelError:
        """Return the same with the means over groups of neighbouring data sets where there are more than are kept.

        A group has neighbouring rates at neighbouring temperatures; each of its members says as much as any other.
        """
        known = np.flatnonzero(np.isfinite(self.left_var))
        if len(self.left_var) <= MOST_KEPT or len(known) == 0:
            return self
        groups = [
            group
            for level in np.array_split(known[np.argsort(self.temperature_c[known], kind="stable")], TEMPERATURES)
            for group in np.array_split(
                level[np.argsort(self.rate_dps[level], kind="stable")], MOST_KEPT // (10 * TEMPERATURES)
            )
            if len(group)
        ]
        columns = (self.rate_dps, self.temperature_c, self.left_var, self.white_var)
        return LocalModelError(*(np.array([column[group].mean() for group in groups]) for column in columns))

    def unknown_at(self, rate_dps: float, temperature_c: float) -> str | None:
        """Return why the error there is unknown, in words; None where it is known."""
        away = self._away(rate_dps, temperature_c)
        if len(away) == 0:
            return "no data set could be left out of the fit: the model needs all data sets"
        if away.min() > FARTHEST:
            return "no data set was measured near there"
        if _effective_number(np.exp(-0.5 * away**2)) < LEAST_NEAR:
            return f"fewer than {LEAST_NEAR:g} data sets were measured near there"
        return None

    def _away(self, rate_dps: float, temperature_c: float) -> Array:
        """Return how far a place is from each data set whose variance is known, in widths of the neighbourhood."""
        away = np.hypot(_scaled(self.rate_dps, rate_dps), _scaled(self.temperature_c, temperature_c))
        return np.asarray(away[np.isfinite(self.left_var)])


def _effective_number(weight: Array) -> float:
    """Return the effective number: how many data sets of equal weight carry as much information."""
    return float(weight.sum() ** 2 / (weight**2).sum())


def _scaled(values: Array, at: float) -> Array:
    """Return distances from a place in widths of the neighbourhood, (m,); 0 along what was not varied."""
    width = NEAR_SHARE * float(np.ptp(values))
    if width == 0:
        return np.zeros(len(values))
    return np.asarray((values - at) / width)
