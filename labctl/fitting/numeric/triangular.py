"""Cholesky factors and triangular systems by LAPACK itself.

The same numbers as by `scipy.linalg`, whose checks take longer than a small system; a criticism solves ten thousand.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dtrtrs


def lower_factor(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lower Cholesky factor (n, n). Raises LinAlgError where the matrix is not positive definite."""
    if not len(matrix):
        return matrix
    factor, info = dpotrf(matrix, lower=1, clean=1)
    if info:
        raise np.linalg.LinAlgError(f"leading minor {info} is not positive definite")
    return np.asarray(factor)


def solve_lower(factor: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the solution of a lower triangular system, of the shape of `values` (n,) or (n, k).

    Raises LinAlgError where the factor is singular.
    """
    if not values.size:
        return np.empty_like(values)
    solved, info = dtrtrs(factor, values, lower=1)
    if info:
        raise np.linalg.LinAlgError(f"element {info} of the diagonal is zero")
    return np.asarray(solved)
