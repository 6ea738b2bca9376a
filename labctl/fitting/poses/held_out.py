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
    """Return the prediction error of each of m moves by coefficients fitted to the other used moves, mask (m,).

    `covariance` (2m, 2m) is that of the residuals. The fit without a used move equals the fit to all
    moves with two further unknowns, which absorb its residual, so that no fit is repeated.
    """
    rows = np.repeat(used, 2)
    jacobian, residual = equations.jacobian[rows], equations.residual[rows]
    move_covariance = covariance[np.ix_(rows, rows)]
    inverse = cho_solve(cho_factor(move_covariance), np.eye(len(residual)))
    weighted = inverse @ jacobian
    normal = np.linalg.inv(jacobian.T @ weighted)
    gain = normal @ weighted.T  # from residuals to coefficients
    residual_inverse = inverse - weighted @ gain
    error, spread = np.zeros((len(used), 2)), np.zeros((len(used), 2, 2))
    for place, move in enumerate(np.flatnonzero(used)):
        pair = slice(2 * place, 2 * place + 2)
        move_inverse = np.linalg.solve(residual_inverse[pair, pair], residual_inverse[pair])
        without = -jacobian[pair] @ (gain - normal @ weighted[pair].T @ move_inverse)
        without[:, pair] += np.eye(2)
        error[move], spread[move] = without @ residual, without @ move_covariance @ without.T
    for move in np.flatnonzero(~used):
        both = np.array([2 * move, 2 * move + 1])
        predict = equations.jacobian[both] @ gain
        shared = covariance[np.ix_(both, np.flatnonzero(rows))] @ predict.T
        error[move] = equations.residual[both] - predict @ residual
        spread[move] = covariance[np.ix_(both, both)] - shared - shared.T + predict @ move_covariance @ predict.T
    return HeldOut(error, spread)
