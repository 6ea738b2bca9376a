"""Least squares with coefficients that cannot be negative, for a handful of columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array


def nonnegative_least_squares(columns: NDArray[np.float64], y: Array) -> Array:
    """Return the coefficients >= 0, (k,), of columns (m, k) of about unit length that come nearest to y (m,).

    By active sets (Lawson and Hanson 1974, chapter 23). SciPy's takes longer to import than this takes altogether.
    """
    gram, inner = columns.T @ columns, columns.T @ y
    solution, is_positive = np.zeros(len(inner)), np.zeros(len(inner), dtype=np.bool_)
    tolerance = 10 * max(columns.shape) * np.finfo(np.float64).eps * float(np.abs(columns).sum(axis=0).max())
    for _ in range(3 * len(inner)):
        slope = np.where(is_positive, -np.inf, inner - gram @ solution)
        if not slope.max() > tolerance:
            break
        is_positive[np.argmax(slope)] = True
        solution = _feasible(gram, inner, solution, is_positive)
    return solution


def _feasible(gram: NDArray[np.float64], inner: Array, solution: Array, is_free: NDArray[np.bool_]) -> Array:
    """Return the solution of the columns that are kept, after leaving out of `is_free` those it makes negative."""
    while True:
        step = np.zeros(len(solution))
        step[is_free] = np.linalg.solve(gram[is_free][:, is_free], inner[is_free])
        negative = is_free & (step <= 0)
        if not negative.any():
            return step
        share = solution[negative] / (solution[negative] - step[negative])
        solution = solution + share.min() * (step - solution)
        is_free[np.flatnonzero(negative)[share <= share.min()]] = False
        solution = np.where(is_free, solution, 0.0)
