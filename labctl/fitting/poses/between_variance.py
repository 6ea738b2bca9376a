"""Variance between measurements beyond what their own noise explains: Mandel and Paule (1970), and by likelihood."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from labctl.fitting.numeric.arrays import Array

#: Logarithm of a likelihood ratio beyond which there is a second variance: 5 % of cases without one, at the bound of
#: its range, where half of chi squared with one degree of freedom is 0 (Self and Liang 1987).
DEMANDED = 2.71 / 2


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


def components(
    jacobian: NDArray[np.float64], residual: Array, covariance: NDArray[np.float64], by_first: NDArray[np.float64],
    information: Callable[[float], float], start: float,
) -> tuple[float, float]:  # fmt: skip
    """Return two variances v1, v2, 0 or more, of measurements with covariance known + v1 by_first + v2 identity.

    By the restricted likelihood (Patterson and Thompson 1971), whose expectation the fit of the p parameters leaves
    alone, times that of other measurements which tell v1 too: `information` is minus the logarithm of theirs. Shapes
    are those of `between_variance`; `start` is a guess of v1. The second is 0 unless the likelihood ratio demands it:
    a variance that cannot be negative would else be too large on average.
    """
    from scipy.optimize import minimize

    scale = np.array([max(start, 1e-18), float(np.diag(covariance + start * by_first).mean())])

    def negative_log_likelihood(variances: Array) -> float:
        first, second = np.append(variances, 0.0)[:2] * scale
        total = covariance + first * by_first + second * np.eye(len(residual))
        return negative_log_restricted_likelihood(jacobian, residual, total) + information(first)

    alone = minimize(negative_log_likelihood, np.ones(1), method="L-BFGS-B", bounds=[(0.0, None)])
    both = minimize(negative_log_likelihood, np.append(alone.x, 0.1), method="L-BFGS-B", bounds=[(0.0, None)] * 2)
    demanded = float(alone.fun - both.fun) > DEMANDED
    first, second = both.x if demanded else (alone.x[0], 0.0)
    return float(first * scale[0]), float(second * scale[1])


def negative_log_restricted_likelihood(
    jacobian: NDArray[np.float64], residual: Array, covariance: NDArray[np.float64]
) -> float:
    """Return minus the logarithm of the restricted likelihood, without its constant."""
    factor = cho_factor(covariance)
    weighted = cho_solve(factor, jacobian)
    normal = jacobian.T @ weighted
    step = np.linalg.solve(normal, weighted.T @ residual)
    residual_left = residual - jacobian @ step
    _, of_normal = np.linalg.slogdet(normal)
    of_covariance = 2 * np.sum(np.log(np.diag(factor[0])))
    return float(of_covariance + of_normal + residual_left @ cho_solve(factor, residual_left)) / 2


def chi2_of(jacobian: NDArray[np.float64], residual: Array, covariance: NDArray[np.float64]) -> float:
    """Return the chi2 that generalised least squares leaves of residuals (m,)."""
    step, _ = gls(jacobian, residual, covariance)
    residual_left = residual - jacobian @ step
    return float(residual_left @ cho_solve(cho_factor(covariance), residual_left))


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
