"""Variance between measurements beyond what their own noise explains (Mandel and Paule 1970)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from labctl.fitting.numeric.arrays import Array


def between_variance(jacobian: NDArray[np.float64], residual: Array, covariance: NDArray[np.float64]) -> float:
    """Return the variance to add to each of m measurements so that chi2 is what their freedom m - p lets expect.

    `jacobian` (m, p), `residual` (m,), `covariance` (m, m) of the known noise; 0 where that noise explains them.
    """
    freedom = len(residual) - jacobian.shape[1]
    if freedom < 1:
        return 0.0

    from scipy.optimize import brentq

    def excess(variance: float) -> float:
        return chi2_of(jacobian, residual, covariance + variance * np.eye(len(residual))) - freedom

    if excess(0.0) <= 0:
        return 0.0
    most = float(residual @ residual)
    return float(brentq(excess, 0.0, 2 * most, xtol=1e-6 * most / len(residual)))


def chi2_of(jacobian: NDArray[np.float64], residual: Array, covariance: NDArray[np.float64]) -> float:
    """Return the chi2 that generalised least squares leaves of residuals (m,)."""
    step, _ = gls(jacobian, residual, covariance)
    left = residual - jacobian @ step
    return float(left @ cho_solve(cho_factor(covariance), left))


def gls(
    jacobian: NDArray[np.float64], residual: Array, covariance: NDArray[np.float64]
) -> tuple[Array, NDArray[np.float64]]:
    """Return the solution (p,) of jacobian (m, p) times it = residual (m,), and its covariance (p, p)."""
    factor = cho_factor(covariance)
    weighted = cho_solve(factor, jacobian)
    inverse = np.linalg.inv(jacobian.T @ weighted)
    return np.asarray(inverse @ (weighted.T @ residual)), np.asarray((inverse + inverse.T) / 2)


def gls_weights(jacobian: NDArray[np.float64], covariance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the matrix (p, m) by which `gls` makes its solution of the residuals."""
    weighted = cho_solve(cho_factor(covariance), jacobian)
    return np.asarray(np.linalg.solve(jacobian.T @ weighted, weighted.T))
