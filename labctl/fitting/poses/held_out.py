"""Held-out moves: each predicted from all others, with the uncertainty of that prediction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.equations import Equations


@dataclass(frozen=True)
class HeldOut:
    """Errors of m moves, each by a fit to the other used ones, two components each, rad."""

    error: NDArray[np.float64]  #: (m, 2)
    covariance: NDArray[np.float64]  #: (m, 2, 2) of the prediction

    @property
    def chi2(self) -> Array:
        """Squared distances, (m,), of two degrees of freedom."""
        solved = np.linalg.solve(self.covariance, self.error[:, :, None])[:, :, 0]
        return np.asarray(np.sum(self.error * solved, axis=1))

    @property
    def within(self) -> NDArray[np.bool_]:
        """Which components are within two standard uncertainties, (m, 2)."""
        return np.asarray(np.abs(self.error) <= 2 * np.sqrt(np.diagonal(self.covariance, axis1=1, axis2=2)))


def held_out_moves(equations: Equations, covariance: NDArray[np.float64], used: NDArray[np.bool_]) -> HeldOut:
    """Return what each of m moves is off from what the used ones, mask (m,), without it say.

    `covariance` (2m, 2m) is that of the residuals. Of a used move by the inverse of the covariance beside the design
    (Dubrule 1983), so that no fit has to be made again.
    """
    m = len(used)
    error, spread = np.zeros((m, 2)), np.zeros((m, 2, 2))
    rows = np.repeat(used, 2)
    jacobian, residual = equations.jacobian[rows], equations.residual[rows]
    factor = cho_factor(covariance[np.ix_(rows, rows)])
    inverse = cho_solve(factor, np.eye(len(residual)))
    weighted = inverse @ jacobian
    normal = np.linalg.inv(jacobian.T @ weighted)
    left = inverse - weighted @ normal @ weighted.T
    for place, move in enumerate(np.flatnonzero(used)):
        here = slice(2 * place, 2 * place + 2)
        spread[move] = np.linalg.inv(left[here, here])
        error[move] = spread[move] @ (left[here] @ residual)
    for move in np.flatnonzero(~used):
        both = np.array([2 * move, 2 * move + 1])
        # the noise that it shares with used moves is known from them; what is left of it, and of the coefficients
        shared = covariance[np.ix_(both, np.flatnonzero(rows))]
        design = equations.jacobian[both] - shared @ weighted
        error[move] = (
            equations.residual[both]
            - shared @ (left @ residual)
            - equations.jacobian[both] @ (normal @ (weighted.T @ residual))
        )
        spread[move] = covariance[np.ix_(both, both)] - shared @ inverse @ shared.T + design @ normal @ design.T
    return HeldOut(error, spread)
