"""Degrees of freedom of a standard uncertainty, and the factor from it to U (GUM, JCGM 100: G.3 and G.4).

The standard uncertainty u is the root of an estimated variance. How well that variance is known is a number nu of
degrees of freedom: the relative variance of the estimate is 2 / nu (Satterthwaite 1946). U = t(95.45 %, nu) u, t of
Student, covers 95.45 %; with all variances known it is 2 u.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr, chdtrc, ndtri, stdtrit

from labctl.fitting.numeric.arrays import Array

#: Probability of an interval of two standard uncertainties of a normal distribution.
COVERAGE_PROBABILITY = 0.9545
#: Degrees of freedom beyond which a t-distribution is a normal one, and below which its factor has no meaning.
MAX_FREEDOM, MIN_FREEDOM = 1e6, 1.0


def student_factor(freedom: float | None, probability: float = COVERAGE_PROBABILITY) -> float:
    """Return the factor of Student's t for a coverage probability (GUM table G.2); of a normal one without freedom."""
    if freedom is None:
        return float(ndtri((1 + probability) / 2))
    return float(stdtrit(min(max(freedom, MIN_FREEDOM), MAX_FREEDOM), (1 + probability) / 2))


def expanded_u(u: Array, freedom: Array) -> Array:
    """Return U = t(95.45 %, nu) u of standard uncertainties (p,) with their degrees of freedom (p,)."""
    return np.array([each * student_factor(float(nu)) for each, nu in zip(u, freedom, strict=True)])


def freedom_of_bounded(freedom: float, known_share: float) -> float:
    """Return the degrees of freedom of a variance that is estimated from residuals, and at least that of known noise.

    The residuals have `freedom` degrees; `known_share` is the known variance over the estimate, 0 to 1. The estimate is
    the larger one of both: max(c, X) with X of chi squared over its freedom. Twice the square of its mean over its
    variance is what counts: `freedom` itself where no noise is known, and more where the bound cuts the scatter off.
    """
    if freedom <= 0:
        return MAX_FREEDOM if known_share >= 1 else MIN_FREEDOM
    bound = min(max(known_share, 0.0), 1.0)
    below = float(chdtr(freedom, freedom * bound))
    first = bound * below + float(chdtrc(freedom + 2, freedom * bound))
    second = bound**2 * below + (freedom + 2) / freedom * float(chdtrc(freedom + 4, freedom * bound))
    return float(np.clip(2 * first**2 / max(second - first**2, 1e-12), MIN_FREEDOM, MAX_FREEDOM))


def combined_freedom(
    variance: Array, parts: Sequence[tuple[Array, Array | float]], scatter: Array | float = 0.0
) -> Array:
    """Return the degrees of freedom (p,) of variances (p,) by Welch and Satterthwaite (GUM eq. G.2b).

    `parts` are the shares of the variances (p,) that are estimated, each with its own degrees of freedom; `scatter`
    (p,) is the variance of `variance` by estimates that are not independent of each other. What is left is known.
    """
    uncertain = np.zeros(len(variance)) + scatter
    for part, freedom in parts:
        uncertain = uncertain + 2 * part**2 / freedom
    return np.asarray(np.clip(2 * variance**2 / np.maximum(uncertain, 1e-300), MIN_FREEDOM, MAX_FREEDOM))


def information_of(
    jacobian: NDArray[np.float64], covariance: NDArray[np.float64], derivatives: Sequence[NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Return the information (q, q) that m residuals give on q parameters of their covariance (m, m).

    That of the restricted likelihood, tr(P D_i P D_j) / 2 with P = V^-1 - V^-1 J (J^T V^-1 J)^-1 J^T V^-1;
    `derivatives` are the D_i (m, m), `jacobian` J (m, p).
    """
    inverse = np.linalg.inv(covariance)
    weighted = inverse @ jacobian
    projected = inverse - weighted @ np.linalg.solve(jacobian.T @ weighted, weighted.T)
    products = [projected @ each for each in derivatives]
    return np.array([[float(np.sum(a * b.T)) / 2 for b in products] for a in products])


def scatter_by_variances(slopes: NDArray[np.float64], information: NDArray[np.float64]) -> Array:
    """Return the variance (p,) of p variances by q estimated components: `slopes` (q, p) are derivatives by them."""
    return np.asarray(np.einsum("qp,qr,rp->p", slopes, np.linalg.pinv(information, hermitian=True), slopes))
