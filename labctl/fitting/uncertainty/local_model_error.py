"""Error of a model near one rate and temperature: the variance that it leaves beyond the readings' own noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.uncertainty.grid import MIN_SPAN_K

#: Width of the neighbourhood, as a share of the range of rates and of temperatures (standard deviation of the weight).
NEAR_SHARE = 0.12
#: Data sets, weighted, that a neighbourhood needs.
MIN_NEAR = 3.0
#: Where fewer are near, as in a plan with one data set at each place, the neighbourhood grows by these factors in turn.
WIDENED = (1.0, 1.5, 2.0, 3.0)
#: Farther than this many widths from every data set nothing is known.
FARTHEST = 2.0
#: A unit is tilted that turns about a second body axis at more than this share of its largest rate.
TILTED_SHARE = 0.1
#: The least variance that is stated, as a share of the standard uncertainty of the estimate itself: a smaller one could
#: not be seen.
MIN_SHARE = 0.25
#: Data sets beyond this many are averaged in groups of neighbours, of temperatures in so many groups.
MAX_KEPT, TEMPERATURES = 2000, 10


NO_TURNED_AXES = (
    "the version was made by an older version of labctl, which did not store about which axes the unit was turned: fit "
    "it again"
)
NONE_NEAR = "no data set was measured near there"
NONE_LEFT_OUT = "no data set could be left out of the fit: the model needs all data sets"
#: Rates about other body axes where the unit turns about one alone.
NO_RATES: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True)
class LocalModelError:
    """Data sets of one axis, (m,) each: where they were, the variance left there, and that of the readings' noise."""

    rate_dps: Array  #: about the axis itself
    temperature_c: Array
    left_var: Array  #: (deg/s)^2, NaN where it is not known
    white_var: Array  #: (deg/s)^2
    across_dps: Mapping[str, Array] | None = None  #: rates about other body axes that were turned; None: not stored

    def at(self, rate_dps: float, temperature_c: float, across_dps: Mapping[str, float] = NO_RATES) -> float | None:
        """Return the standard error of the model there, deg/s, drift of the campaign included; None if unknown.

        `across_dps` are rates about other body axes. A single-axis table turns about one body axis after the other, so
        what the model leaves at each of these rates is added: beside that of the axis itself, for which data sets at
        any rate about the others count, what a rate about another axis leaves beyond that of rest.
        """
        return self.at_or_why(rate_dps, temperature_c, across_dps)[0]

    def at_or_why(
        self, rate_dps: float, temperature_c: float, across_dps: Mapping[str, float] = NO_RATES
    ) -> tuple[float | None, str | None]:
        """Return `at` and `unknown_at`, of which one is None."""
        reason = self.unknown_at(rate_dps, temperature_c, across_dps)
        return (None if reason else self._at_known(rate_dps, temperature_c, across_dps)), reason

    def _at_known(self, rate_dps: float, temperature_c: float, across_dps: Mapping[str, float]) -> float:
        variance = self._variance(self._away(rate_dps, temperature_c))
        turning_dps = {axis: rate for axis, rate in across_dps.items() if rate}
        if not turning_dps:
            return float(np.sqrt(variance))
        away = self._away(0.0, temperature_c)
        remaining = variance if _unknown(away) else self._variance(away)
        beyond = (
            self._variance(self._away_across(axis, rate, temperature_c)) - remaining
            for axis, rate in turning_dps.items()
        )
        return float(np.sqrt(variance + sum(max(each, 0.0) for each in beyond)))

    def _variance(self, distance: Array) -> float:
        """Return the variance left, (deg/s)^2, where the data sets with a known one are so far away, in widths."""
        is_finite, weight = np.isfinite(self.left_var), near_weights(distance)
        near = effective_number(weight)
        weight /= weight.sum()
        residual_var = float(weight @ self.left_var[is_finite])
        noise = float(weight @ self.white_var[is_finite])
        unseen = MIN_SHARE * np.sqrt(2 / near) * max(residual_var, noise)
        return float(max(residual_var - noise, unseen))

    def thinned(self) -> LocalModelError:
        """Return the same with the means over groups of neighbouring data sets where there are more than are kept.

        A group has neighbouring rates about one body axis at neighbouring temperatures; each of its members says as
        much as any other.
        """
        finite_rows = np.flatnonzero(np.isfinite(self.left_var))
        if len(self.left_var) <= MAX_KEPT or len(finite_rows) == 0:
            return self
        across = self.across_dps or {}
        rates = np.stack([self.rate_dps, *across.values()])
        about = np.argmax(np.abs(rates), axis=0)
        groups = [
            group
            for axis in range(len(rates))
            for level in np.array_split(
                _sorted(finite_rows[about[finite_rows] == axis], self.temperature_c), TEMPERATURES
            )
            for group in np.array_split(_sorted(level, rates[axis]), MAX_KEPT // (10 * TEMPERATURES))
            if len(group)
        ]

        def mean(column: Array) -> Array:
            return np.array([column[group].mean() for group in groups])

        return LocalModelError(
            mean(self.rate_dps), mean(self.temperature_c), mean(self.left_var), mean(self.white_var),
            {axis: mean(each) for axis, each in across.items()},
        )  # fmt: skip

    def unknown_at(
        self, rate_dps: float, temperature_c: float, across_dps: Mapping[str, float] = NO_RATES
    ) -> str | None:
        """Return why the error there is unknown, in words; None where it is known."""
        away = self._away(rate_dps, temperature_c)
        if len(away) == 0:
            return NONE_LEFT_OUT
        if (reason := _unknown(away)) is not None:
            return reason
        for axis, rate in across_dps.items():
            if rate and (reason := self._unknown_across(axis, rate, temperature_c)) is not None:
                return reason
        return None

    def _unknown_across(self, axis: str, rate_dps: float, temperature_c: float) -> str | None:
        """Return why the error at a rate about another body axis is unknown; None where it is known."""
        if self.across_dps is None:
            return NO_TURNED_AXES
        if axis not in self.across_dps:
            return f"the unit was not turned about {axis}"
        away = self._away_across(axis, rate_dps, temperature_c)
        if len(away) == 0:
            return NONE_LEFT_OUT
        reason = _unknown(away)
        return None if reason is None else f"about {axis}, {reason}"

    def _away(self, rate_dps: float, temperature_c: float) -> Array:
        """Return how far a place is from each data set whose variance is known, in widths of the neighbourhood."""
        return self._distance([_scaled(self.rate_dps, rate_dps)], temperature_c)

    def _away_across(self, axis: str, rate_dps: float, temperature_c: float) -> Array:
        """Return the same for a rate about another body axis alone.

        Of a tilted unit, which turns about several at once, the part about this axis counts: what its output is off by
        then is no less than what this axis adds, unless errors of several axes cancel.
        """
        across = self.across_dps or {}
        others = [_scaled(rates, 0.0) for name, rates in (("", self.rate_dps), *across.items()) if name != axis]
        beside = [np.where(self._is_tilted, 0.0, each) for each in others]
        return self._distance([_scaled(across[axis], rate_dps), *beside], temperature_c)

    @cached_property
    def _is_tilted(self) -> NDArray[np.bool_]:
        """Whether the unit turned about more than one body axis in a data set, (m,)."""
        sizes = np.sort(np.abs([self.rate_dps, *(self.across_dps or {}).values()]), axis=0)
        return np.asarray(sizes[-2] > TILTED_SHARE * sizes[-1])

    def warmth_away(self, temperature_c: float) -> Array:
        """Return how far a temperature is from that of each data set, (m,) widths of the neighbourhood."""
        return np.abs(_scaled(self.temperature_c, temperature_c, MIN_SPAN_K / 2))

    def _distance(self, rates: list[Array], temperature_c: float) -> Array:
        away = np.linalg.norm([*rates, self.warmth_away(temperature_c)], axis=0)
        return np.asarray(away[np.isfinite(self.left_var)])


def _unknown(distance: Array) -> str | None:
    """Return why nothing is known so far, in widths, from the data sets; None where something is."""
    if distance.min() > FARTHEST:
        return NONE_NEAR
    if effective_number(near_weights(distance)) < MIN_NEAR:
        return f"fewer than {MIN_NEAR:g} data sets were measured near there"
    return None


def _sorted(rows: NDArray[np.int64], by: Array) -> NDArray[np.int64]:
    return rows[np.argsort(by[rows], kind="stable")]


def near_weights(distance: Array) -> Array:
    """Return the weights of data sets so far away, in widths: of the narrowest neighbourhood with enough of them."""
    for factor in WIDENED:
        weight = np.exp(-0.5 * (distance / factor) ** 2)
        if effective_number(weight) >= MIN_NEAR:
            break
    return np.asarray(weight)


def effective_number(weight: Array) -> float:
    """Return the effective number: how many data sets of equal weight carry as much information."""
    return float(weight.sum() ** 2 / (weight**2).sum())


def _scaled(values: Array, at: float, least_width: float = 0.0) -> Array:
    """Return distances from a place in widths of the neighbourhood, (m,); 0 along what was not varied.

    The width is a share of the range of the values, or `least_width` where that is more.
    """
    width = max(NEAR_SHARE * float(np.ptp(values)), least_width)
    if width == 0:
        return np.zeros(len(values))
    return np.asarray((values - at) / width)
