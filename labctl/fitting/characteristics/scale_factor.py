"""Scale factor, its nonlinearity, asymmetry and change with temperature, from the best straight line.

IEEE Std 528-2019 names the terms; IEEE Std 952-2020 takes the scale factor as the slope of the straight line fitted by
least squares to output over input, nonlinearity as the deviations from it, and asymmetry as the difference of the
slopes of positive and negative inputs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from labctl.fitting.characteristics.estimate import Estimate
from labctl.fitting.numeric.arrays import Array

PPM = 1e6
#: Rates less than this share of the fastest apart are one.
SAME_RATE = 1e-3
#: Least range of temperatures over which a change with temperature is stated, K.
LEAST_SPAN_C = 1.0
#: Largest condition number of the columns, each of length 1, by which rate and temperature are distinguished.
MOST_CONDITION = 10.0


@dataclass(frozen=True)
class StraightLine:
    """The best straight line through output over rate, both deg/s: slope, intercept and what is left, (m,)."""

    scale_factor: Estimate
    bias_dps: Estimate
    residual_dps: Array


def straight_line(rate_dps: Array, output_dps: Array) -> StraightLine | None:
    """Return the line through m data sets by least squares; None with fewer than two different rates."""
    if different_rates(rate_dps) < 2:
        return None
    columns = np.column_stack([np.ones(len(rate_dps)), rate_dps])
    values, u, residual = _solved(columns, output_dps)
    return StraightLine(Estimate(values[1], u[1]), Estimate(values[0], u[0]), residual)


def nonlinearity_ppm(line: StraightLine, full_scale_dps: float, u_mean_dps: Array | None) -> Estimate:
    """Return the largest deviation from the line over the full scale, referred to the input, ppm.

    `u_mean_dps`, (m,), is the standard uncertainty of each data set's mean.
    """
    at = int(np.argmax(np.abs(line.residual_dps)))
    per_dps = PPM / (line.scale_factor.value * full_scale_dps)
    u = None if u_mean_dps is None else float(abs(per_dps) * u_mean_dps[at])
    return Estimate(float(abs(line.residual_dps[at] * per_dps)), u)


def asymmetry_ppm(rate_dps: Array, output_dps: Array) -> Estimate | None:
    """Return the slope at positive rates minus that at negative ones, over their mean, ppm; both lines share the bias.

    None with fewer than two different rates of each sign.
    """
    if different_rates(rate_dps[rate_dps > 0]) < 2 or different_rates(rate_dps[rate_dps < 0]) < 2:
        return None
    columns = np.column_stack([np.ones(len(rate_dps)), rate_dps, np.abs(rate_dps) / 2])
    values, u, _ = _solved(columns, output_dps)  # slope of one sign: mean plus, or minus, half the difference
    per_slope = PPM / values[1]
    return Estimate(float(values[2] * per_slope), None if u[2] is None else float(abs(u[2] * per_slope)))


def slope_over(temperature_c: Array, estimates: list[Estimate]) -> Estimate | None:
    """Return the change of a figure per K, by a straight line over temperature; None with one temperature.

    Its uncertainty is the larger one of the scatter about the line and of what the figures' own carry on to the slope.
    """
    if len(temperature_c) < 2 or float(np.ptp(temperature_c)) < LEAST_SPAN_C:
        return None
    columns = np.column_stack([np.ones(len(temperature_c)), temperature_c - temperature_c.mean()])
    values, u, _ = _solved(columns, np.array([estimate.value for estimate in estimates]))
    weights = columns[:, 1] / float(columns[:, 1] @ columns[:, 1])
    known_u = [estimate.u for estimate in estimates if estimate.u is not None]
    carried = float(np.sqrt(np.sum((weights * np.array(known_u)) ** 2))) if len(known_u) == len(estimates) else None
    stated_u = [each for each in (u[1], carried) if each is not None]
    return Estimate(values[1], max(stated_u) if stated_u else None)


def changes_with_temperature(
    rate_dps: Array, temperature_c: Array, output_dps: Array
) -> tuple[Estimate, Estimate] | None:
    """Return the change of the bias, deg/s/K, and of the scale factor, 1/K, from m data sets at any temperatures.

    Intercept and slope of one line change linearly with the temperature, by least squares: for temperatures that are no
    levels with a line each. None with one temperature or one rate, and where rate and temperature changed together, so
    that a change with one of them looks like a change with the other.
    """
    if len(rate_dps) <= 4 or different_rates(rate_dps) < 2 or float(np.ptp(temperature_c)) < LEAST_SPAN_C:
        return None
    warmer = temperature_c - temperature_c.mean()
    columns = np.column_stack([np.ones(len(rate_dps)), rate_dps, warmer, rate_dps * warmer])
    sizes = np.linalg.norm(columns, axis=0)
    if not np.all(sizes > 0.0) or np.linalg.cond(columns / sizes) > MOST_CONDITION:
        return None
    values, u, _ = _solved(columns, output_dps)
    return Estimate(values[2], u[2]), Estimate(values[3], u[3])


def different_rates(rate_dps: Array) -> int:
    """Return how many different rates there are, to a thousandth of the fastest."""
    if not len(rate_dps):
        return 0
    step = max(float(np.max(np.abs(rate_dps))) * SAME_RATE, 1e-6)
    return len(np.unique(np.round(rate_dps / step)))


def _solved(columns: Array, values: Array) -> tuple[list[float], list[float | None], Array]:
    """Return coefficients, their standard uncertainties by the scatter about the fit, and what is left."""
    solution, *_ = np.linalg.lstsq(columns, values, rcond=None)
    residual = values - columns @ solution
    freedom = len(values) - columns.shape[1]
    if freedom < 1:
        return solution.tolist(), [None] * columns.shape[1], residual
    variance = float(residual @ residual) / freedom
    u = np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)) * variance)
    return solution.tolist(), u.tolist(), residual
