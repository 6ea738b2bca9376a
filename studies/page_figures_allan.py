"""Intervals of an Allan deviation and the figures of IEEE Std 952, written here from the documentation: NumPy only.

Of a record that shows white noise and neither quantization, a ramp, a filter nor a slow trend, as
`docs/explanation/criticism.md` states under *Noise at rest*; N, B and K are sized beside each other.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

Array = np.ndarray
#: Variances follow a sum of power laws to this share at best; what neighbouring octaves share makes u so much larger.
TOLERANCE, NEIGHBOURS = 0.02, 1.6
PROBABILITY = 0.95
ROUNDS = 100
#: Chance with which a variance at one octave is below the truth by more than a bound allows.
BOUND_CHANCE = 0.005
#: Variances bend downwards by this many deviations only behind a filter or a vibration.
BENDS = 3.0
#: Of the variance at its own averaging time, a filter lets pass this share at least.
PASSED = 0.5


def freedom_of_white(readings: int, m: Array) -> Array:
    """Return the degrees of freedom of overlapping variances of white noise at m readings (NIST SP 1065, table 5)."""
    n = readings + 1.0  # of phases
    return np.maximum((3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5), 1.0)


def interval(deviation: Array, freedom: Array) -> tuple[Array, Array]:
    """Return the 95 % interval of deviations (k,) by chi-square."""
    tail = (1 - PROBABILITY) / 2
    limits = [[math.sqrt(nu / _chi_square(nu, p)) for nu in freedom.tolist()] for p in (1 - tail, tail)]
    return deviation * np.array(limits[0]), deviation * np.array(limits[1])


def freedom_of_flicker(readings: int, m: Array) -> Array:
    """Return the same of flicker noise of the rate."""
    n = readings + 1.0
    longer = 5 * n**2 / (4 * m * (n + 3 * m))
    return np.maximum(np.where(m == 1, 2 * (n - 2) ** 2 / (2.3 * n - 4.9), longer), 1.0)


def freedom_of_walk(readings: int, m: Array) -> Array:
    """Return the same of a random walk of the rate."""
    n = readings + 1.0
    return np.maximum((n - 2) / m * ((n - 1) ** 2 - 3 * m * (n - 1) + 4 * m**2) / (n - 3) ** 2, 1.0)


def bounds(variance: Array, tau_s: Array, m: Array, readings: int) -> dict[str, float]:
    """Return the largest N, B and K, in deg/s and s, that a record without coarse steps is compatible with."""
    white = freedom_of_white(readings, m)
    bend = np.diff(np.log(variance), 2)
    deviation = np.sqrt(2 / white[2:] + 4 * 2 / white[1:-1] + 2 / white[:-2])
    down = np.flatnonzero(bend < -BENDS * deviation)
    used = slice(int(down[-1]) + 2 if len(down) else 0, None)
    variance, tau_s, m = variance[used], tau_s[used], m[used]
    passed = 1 - (1 - PASSED) * tau_s[0] / tau_s
    shapes = {"N": 1 / tau_s, "B": np.full(len(tau_s), 2 * np.log(2) / np.pi), "K": tau_s / 3}
    freedoms = {"N": freedom_of_white, "B": freedom_of_flicker, "K": freedom_of_walk}
    return {
        name: math.sqrt(min(v * nu / _chi_square(nu, BOUND_CHANCE) / (p * s) for v, nu, p, s in zip(
            variance.tolist(), freedoms[name](readings, m).tolist(), passed.tolist(), shape.tolist(), strict=True
        )))
        for name, shape in shapes.items()
    }  # fmt: skip


def terms(variance: Array, tau_s: Array, m: Array, readings: int) -> tuple[Array, float, float]:
    """Return the fitted deviations (k,), N in deg/s/sqrt(Hz) and its u."""
    freedom = 1 / (1 / freedom_of_white(readings, m) + TOLERANCE**2 / 2)
    columns = np.column_stack([1 / tau_s, np.full(len(tau_s), 2 * np.log(2) / np.pi), tau_s / 3])
    model = variance
    for _ in range(ROUNDS):  # chi-square distributed variances are likeliest at weights by the model itself
        weight = np.sqrt(freedom / 2) / model
        squares = _not_negative(columns * weight[:, None], variance * weight)
        model = columns @ squares
    rows = columns * (np.sqrt(freedom / 2) / model)[:, None]
    size = np.linalg.norm(rows, axis=0)
    covariance = np.linalg.inv(rows.T @ rows / np.outer(size, size)) / np.outer(size, size)
    n = math.sqrt(squares[0])
    return np.sqrt(model), n, NEIGHBOURS * math.sqrt(covariance[0, 0]) / (2 * n)


def _not_negative(columns: Array, values: Array) -> Array:
    """Return the least-squares coefficients, none below 0: those of the best set of columns that has none."""
    best, least = np.zeros(columns.shape[1]), np.inf
    for k in range(1, columns.shape[1] + 1):
        for kept in map(list, itertools.combinations(range(columns.shape[1]), k)):
            found = np.linalg.lstsq(columns[:, kept], values, rcond=None)[0]
            left = float(np.sum((values - columns[:, kept] @ found) ** 2))
            if np.all(found >= 0) and left < least:
                best, least = np.zeros(columns.shape[1]), left
                best[kept] = found
    return best


def _chi_square(freedom: float, probability: float) -> float:
    """Return the value below which chi-square is with a probability: Newton's steps on a series of its integral."""
    x, half = freedom, freedom / 2
    for _ in range(100):
        term = inside = 1 / half
        k = 0
        while term > 1e-17 * inside:
            k += 1
            term *= (x / 2) / (half + k)
            inside += term
        log = half * math.log(x / 2) - x / 2 - math.lgamma(half)
        step = (inside * math.exp(log) - probability) / (math.exp(log) / x)
        x = max(x - step, x / 10)
        if abs(step) < 1e-12 * x:
            break
    return x
