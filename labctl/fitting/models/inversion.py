"""Inversion of a forward law: the true rates whose modelled outputs are the measured ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from labctl.errors import LabctlError
from labctl.fitting.numeric.arrays import Array

#: Error of one axis, (n,) deg/s, at rates axis -> (n,) deg/s.
ErrorOfRates = Callable[[Mapping[str, Array], str], Array]
#: Steps of the fixed-point iteration, and the step in deg/s at which it has converged.
FIXED_POINT_STEPS, FIXED_POINT_STEP_DPS = 60, 1e-12
#: The fixed-point iteration diverges when a step is this many times the one before.
DIVERGING = 3.0
#: Newton's method: steps, the step of its numerical derivative in deg/s, and the least slope of output over rate.
NEWTON_STEPS, SLOPE_STEP_DPS, LEAST_SLOPE = 40, 1e-4, 1e-3
#: Bisection: rounds over the axes, halvings of an interval, and the step in deg/s at which the rounds have converged.
ROUNDS, HALVINGS, ROUND_STEP_DPS = 8, 50, 1e-9
#: Half of the first interval of a bisection: this share of the largest output, plus this many deg/s.
REACH_SHARE, REACH_DPS = 0.02, 10.0


class NotConverged(LabctlError):
    """The model's error changes faster than the rate itself, so it cannot be inverted."""

    slug = "not-converged"


def invert(outputs: Mapping[str, Array], error_dps: ErrorOfRates, name: str) -> dict[str, Array]:
    """Return rates with output = rate + error(rates), axis -> (n,) deg/s, for outputs axis -> (n,) deg/s.

    By fixed-point iteration, which converges because a gyro's error changes far less than its rate; where it does not,
    by Newton's method, and where that fails by bisection. `name` is the model's, for the message of NotConverged, which
    is raised when none of them converges.
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
    return _by_newton(outputs, error_dps) or _by_bisection(outputs, error_dps, name)


def _by_newton(outputs: Mapping[str, Array], error_dps: ErrorOfRates) -> dict[str, Array] | None:
    """Solve by Newton's method along each own axis, for laws that bend far from a line; None where it fails."""
    rates = dict(outputs)
    for _ in range(NEWTON_STEPS):
        nearer = {}
        for axis, output in outputs.items():
            here = error_dps(rates, axis)
            slope = (error_dps({**rates, axis: rates[axis] + SLOPE_STEP_DPS}, axis) - here) / SLOPE_STEP_DPS
            if not np.all(slope > LEAST_SLOPE - 1.0):
                return None
            nearer[axis] = rates[axis] - (rates[axis] + here - output) / (1.0 + slope)
        change = _largest_change(nearer, rates)
        rates = nearer
        if change < ROUND_STEP_DPS:
            return rates
    return None


def _by_bisection(outputs: Mapping[str, Array], error_dps: ErrorOfRates, name: str) -> dict[str, Array]:
    """Solve axis by axis, round after round: slower, and right where an error has a steep flank."""
    rates = dict(outputs)
    change = 0.0
    for _ in range(ROUNDS):
        before = dict(rates)
        for axis, output in outputs.items():
            rates = {**rates, axis: _bisected(output, error_dps, rates, axis)}
        change = _largest_change(rates, before)
        if change < ROUND_STEP_DPS:
            return rates
    raise NotConverged(
        f"model {name!r} could not be inverted: the last step still changed the rate by {change:.3g} "
        "deg/s; its coefficients are not those of a gyro (check the fit's validity range and the output's scale)"
    )


def _bisected(output: Array, error_dps: ErrorOfRates, rates: Mapping[str, Array], axis: str) -> Array:
    reach = REACH_SHARE * np.max(np.abs(output), initial=0.0) + REACH_DPS
    low, high = output - reach, output + reach
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        above = middle + error_dps({**rates, axis: middle}, axis) > output
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return np.asarray(0.5 * (low + high))


def _largest_change(rates: Mapping[str, Array], before: Mapping[str, Array]) -> float:
    return max(float(np.max(np.abs(rates[axis] - before[axis]), initial=0.0)) for axis in rates)
