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


def freedom_of_white(readings: int, m: Array) -> Array:
    """Return the degrees of freedom of overlapping variances of white noise at m readings (NIST SP 1065, table 5)."""
    n = readings + 1.0  # of phases
    return np.maximum((3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5), 1.0)


def interval(deviation: Array, freedom: Array) -> tuple[Array, Array]:
    """Return the 95 % interval of deviations (k,) by chi-square."""
    tail = (1 - PROBABILITY) / 2
    limits = [[math.sqrt(nu / _chi_square(nu, p)) for nu in freedom.tolist()] for p in (1 - tail, tail)]
    return deviation * np.array(limits[0]), deviation * np.array(limits[1])


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
