"""Inversion of a forward law: the true rates whose modelled outputs are the measured ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from labctl.errors import LabctlError
from labctl.fitting.numeric.arrays import Array

#: Error of one axis, (n,) deg/s, at rates axis -> (n,) deg/s.
ErrorOfRates = Callable[[Mapping[str, Array], str], Array]
#: Steps of the fixed-point iteration, and the step in deg/s at which it has converged.
FIXED_POINT_STEPS, FIXED_POINT_STEP_DPS = 60, 1e-12
#: The fixed-point iteration diverges when a step is this many times the one before.
DIVERGING = 3.0
#: Newton's method: steps, the step of its numerical derivative in deg/s, and the least slope of output over rate.
NEWTON_STEPS, SLOPE_STEP_DPS, MIN_SLOPE = 40, 1e-4, 1e-3
#: Where the output changes by less than this share of the rate, from no rate on, the rate is in a dead band.
DEAD_BAND_SLOPE = 0.1
#: Bisection: rounds over the axes, halvings of an interval, and the step in deg/s at which the rounds have converged.
ROUNDS, HALVINGS, ROUND_STEP_DPS = 8, 50, 1e-9
#: Half of the interval of a bisection: this share of the largest output, plus this many deg/s; where it holds no root
#: the second share is tried, which holds that of any gain from 0.5 on.
REACH_SHARES, REACH_DPS = (0.02, 1.0), 10.0
#: The root nearest an output is looked for in so many steps, the first of so many deg/s.
STEPS, FIRST_STEP_DPS = 60, 1e-3


class NotConverged(LabctlError):
    """The model's error changes faster than the rate itself, so it cannot be inverted."""

    slug = "not-converged"


def invert(outputs: Mapping[str, Array], error_dps: ErrorOfRates, name: str) -> dict[str, Array]:
    """Return rates with output = rate + error(rates), axis -> (n,) deg/s, for outputs axis -> (n,) deg/s.

    By fixed-point iteration, which converges because a gyro's error changes far less than its rate; where it does not,
    by Newton's method, and where that fails by bisection. `name` is the model's, for the message of NotConverged, which
    is raised when none of them converges, or where no rate near an output has that output. An output that is not a
    number has none.
    """
    rates, change = dict(outputs), 0.0
    for _ in range(FIXED_POINT_STEPS):
        nearer = {axis: outputs[axis] - error_dps(rates, axis) for axis in outputs}
        before, change = change, _largest_change(nearer, rates)
        rates = nearer
        if change < FIXED_POINT_STEP_DPS:
            return rates
        if before and change > DIVERGING * before:
            break
    rates = _by_newton(outputs, error_dps) or _by_bisection(outputs, error_dps, name)
    return _with_dead_bands(rates, outputs, error_dps)


def _with_dead_bands(
    rates: Mapping[str, Array], outputs: Mapping[str, Array], error_dps: ErrorOfRates
) -> dict[str, Array]:
    """Return rates of which those in a dead band are what the output is beyond that of no rate, axis -> (n,) deg/s.

    Between them and no rate the output hardly changes: noise of the output would be many times larger in the rate, and
    pass from one edge of the band to the other.
    """
    corrected = {}
    for axis, rate in rates.items():
        beyond = outputs[axis] - error_dps({**rates, axis: np.zeros_like(rate)}, axis)
        corrected[axis] = np.where(np.abs(beyond) < DEAD_BAND_SLOPE * np.abs(rate), beyond, rate)
    return corrected


def _by_newton(outputs: Mapping[str, Array], error_dps: ErrorOfRates) -> dict[str, Array] | None:
    """Solve by Newton's method along each own axis, for laws that bend far from a line; None where it fails."""
    rates = dict(outputs)
    for _ in range(NEWTON_STEPS):
        nearer = {}
        for axis, output in outputs.items():
            at_rates = error_dps(rates, axis)
            slope = (error_dps({**rates, axis: rates[axis] + SLOPE_STEP_DPS}, axis) - at_rates) / SLOPE_STEP_DPS
            if not np.all(slope > MIN_SLOPE - 1.0):
                return None
            nearer[axis] = rates[axis] - (rates[axis] + at_rates - output) / (1.0 + slope)
        change = _largest_change(nearer, rates)
        rates = nearer
        if change < ROUND_STEP_DPS:
            return rates if _are_near(rates, outputs) else None
    return None


def _are_near(rates: Mapping[str, Array], outputs: Mapping[str, Array]) -> bool:
    """Return whether every rate is one that a gyro with such an output can have had."""
    return not any(np.any(np.abs(rates[axis] - output) > _reach(output)[-1]) for axis, output in outputs.items())


def _by_bisection(outputs: Mapping[str, Array], error_dps: ErrorOfRates, name: str) -> dict[str, Array]:
    """Solve axis by axis, round after round: slower, and right where an error has a steep flank."""
    rates = dict(outputs)
    change = 0.0
    for _ in range(ROUNDS):
        before, outside = dict(rates), {}
        for axis, output in outputs.items():
            rate, outside[axis] = _bisected(output, error_dps, rates, axis)
            rates = {**rates, axis: rate}
        change = _largest_change(rates, before)
        if change < ROUND_STEP_DPS:
            _require_roots(outputs, outside, name)
            return rates
    raise NotConverged(
        f"model {name!r} cannot be inverted: the last iteration still changed the rate by {change:.3g} deg/s; "
        "check the validity range of the fit and the scale of the output: these coefficients are implausible "
        "for a gyro"
    )


def _require_roots(outputs: Mapping[str, Array], outside: Mapping[str, NDArray[np.bool_]], name: str) -> None:
    """Raise NotConverged where no rate near an output has that output: a bisection ends at the edge of its interval."""
    for axis, rows in outside.items():
        if rows.any():
            row = int(np.argmax(rows))
            raise NotConverged(
                f"model {name!r} cannot be inverted: on axis {axis}, no true rate within "
                f"{_reach(outputs[axis])[-1]:.3g} deg/s of the output explains the output "
                f"{outputs[axis][row]:.6g} deg/s ({int(rows.sum())} of {len(rows)} rows); check sign, unit and "
                "axes of the output: these coefficients are implausible for a gyro"
            )


def _reach(output: Array) -> list[float]:
    """Return half intervals to try, deg/s, the narrow one first."""
    largest = float(np.max(np.abs(output[np.isfinite(output)]), initial=0.0))
    return [share * largest + REACH_DPS for share in REACH_SHARES]


def _bisected(
    output: Array, error_dps: ErrorOfRates, rates: Mapping[str, Array], axis: str
) -> tuple[Array, NDArray[np.bool_]]:
    """Return the rates of one axis, (n,) deg/s, and where the interval holds none, (n,)."""

    def excess(at: Array) -> Array:
        return np.asarray(at + error_dps({**rates, axis: at}, axis) - output)

    low, high, outside = output, output, np.ones(len(output), dtype=np.bool_)
    for reach in _reach(output):
        low, high = np.where(outside, output - reach, low), np.where(outside, output + reach, high)
        outside = np.asarray((excess(low) > 0) | (excess(high) < 0))
        if not outside.any():
            break
    low, high = _nearest(output, low, high, excess)
    rising = excess(low) <= 0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        beyond = (excess(middle) > 0) == rising
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    return np.asarray(0.5 * (low + high)), outside


def _nearest(output: Array, low: Array, high: Array, excess: Callable[[Array], Array]) -> tuple[Array, Array]:
    """Return the part of each interval that holds the root nearest the output, (n,) deg/s each.

    Several rates may have one output: in a dead band all have the same. The nearest is taken, as an error is far
    smaller than the rate.
    """
    reach = high - output
    found, last_step = np.isnan(output), 0.0
    below = above = excess(output)
    for step in np.geomspace(FIRST_STEP_DPS, float(np.nanmax(reach, initial=FIRST_STEP_DPS)), STEPS):
        next_below, next_above = excess(output - step), excess(output + step)
        for turned, begin, end in (
            (below * next_below <= 0, output - step, output - last_step),
            (above * next_above <= 0, output + last_step, output + step),
        ):
            first = turned & ~found & (step <= reach)
            low, high, found = np.where(first, begin, low), np.where(first, end, high), found | first
        if found.all():
            break
        below, above, last_step = next_below, next_above, float(step)
    return low, high


def _largest_change(rates: Mapping[str, Array], before: Mapping[str, Array]) -> float:
    """Return the largest change, deg/s; what is not a number stays so and does not count."""
    changes = [np.abs(rates[axis] - before[axis]) for axis in rates]
    return max(float(np.max(change[~np.isnan(change)], initial=0.0)) for change in changes)
