"""Ohio State's fibre-optic gyro on a heated rate table: the sine of an open loop, and polynomials, by least squares."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from studies.real.independent.files import Array, Found, Value, columns_of, root_mean_square

#: Output per deg/s near rest, as its source states it (-1.6 per rad/s).
NOMINAL = -1.6 * np.pi / 180.0
CENTRE_C, PARTS = 43.0, 8


def dwells() -> tuple[Array, Array, Array]:
    """Return the rate of the table (695,) deg/s, the output in nominal deg/s and the temperature about 43 deg C, K."""
    columns = columns_of("osu-rate-table.csv")
    rate, output, warm = (np.asarray(values, dtype=np.float64) for values in columns.values())
    return np.degrees(rate), output / NOMINAL, warm - CENTRE_C


def straight(rate: Array, warm: Array) -> Array:
    """Return the design of bias and scale factor, each a parabola in temperature, (n, 6)."""
    powers = np.column_stack([warm**k for k in range(3)])
    return np.column_stack([powers, powers * rate[:, None]])


def direct(output: Array, warm: Array) -> Array:
    """Return the design of a cubic in the output whose coefficients are parabolas in temperature, (n, 12)."""
    return np.column_stack([output**j * warm**k for j in range(4) for k in range(3)])


def sine(parameters: Array, rate: Array, warm: Array) -> Array:
    """Return the output of an open loop: parabolas for bias and scale factor, of sin(k rate) / k; k per deg/s."""
    *linear, k = parameters
    return straight(np.sin(k * rate) / k, warm) @ np.asarray(linear)


def fit_sine(rate: Array, output: Array, warm: Array) -> tuple[Array, Array]:
    """Return the parameters of the sine and their covariance."""
    start = np.concatenate([np.linalg.lstsq(straight(rate, warm), output, rcond=None)[0], [0.005]])
    found = least_squares(
        lambda p: sine(p, rate, warm) - output, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    variance = float(found.fun @ found.fun) / (len(rate) - len(start))
    return found.x, variance * np.linalg.inv(found.jac.T @ found.jac)


def analysis() -> Found:
    """Return the sine's coefficients, and errors of three laws, on all dwells and on eighths of the range left out."""
    rate, output, warm = dwells()
    values, covariance = fit_sine(rate, output, warm)
    u = np.sqrt(np.diag(covariance))
    k = np.degrees(values[6])  # rad per (rad/s)
    found: Found = {
        "bias at 43 deg C, deg/s": Value(float(values[0]), float(u[0])),
        "scale factor at 43 deg C, 1e-3": Value(1e3 * float(values[3] - 1), 1e3 * float(u[3])),
        "scale factor, slope at 43 deg C, 1e-6/K": Value(1e6 * float(values[4]), 1e6 * float(u[4])),
        "sine, k, rad/(rad/s)": Value(float(k), float(np.degrees(u[6]))),
        "error of bias and scale factor, deg/s": Value(_error_straight(rate, output, warm)),
        "error with the sine, deg/s": Value(_error_sine(rate, output, warm, values)),
        "error with the sine at temperatures left out of the fit, deg/s": Value(_held_out(rate, output, warm)),
        "error of twelve coefficients in the output, deg/s": Value(_error_direct(rate, output, warm)),
    }
    return found


def _slope(values: Array, warm: Array) -> Array:
    return np.asarray(values[3] + values[4] * warm + values[5] * warm**2)


def _error_straight(rate: Array, output: Array, warm: Array) -> float:
    values = np.linalg.lstsq(straight(rate, warm), output, rcond=None)[0]
    return root_mean_square((output - straight(rate, warm) @ values) / _slope(values, warm))


def _error_sine(rate: Array, output: Array, warm: Array, values: Array) -> float:
    """Corrected rate minus the table's: the residual over the slope of the response."""
    left = output - sine(values, rate, warm)
    return root_mean_square(left / (_slope(values, warm) * np.cos(values[6] * rate)))


def _held_out(rate: Array, output: Array, warm: Array) -> float:
    part = np.argsort(np.argsort(warm, kind="stable")) * PARTS // len(warm)
    left = []
    for out in range(PARTS):
        seen, tested = part != out, part == out
        values, _ = fit_sine(rate[seen], output[seen], warm[seen])
        of_output = output[tested] - sine(values, rate[tested], warm[tested])
        left.append(of_output / (_slope(values, warm[tested]) * np.cos(values[6] * rate[tested])))
    return root_mean_square(np.concatenate(left))


def _error_direct(rate: Array, output: Array, warm: Array) -> float:
    design = direct(output / 100.0, warm / 5.0)
    return root_mean_square(rate - design @ np.linalg.lstsq(design, rate, rcond=None)[0])
