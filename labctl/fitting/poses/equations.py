"""Two equations of each move: the direction of gravity at its end by the gyro, minus that of the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer
from labctl.fitting.poses.at_rest.bias import Bias
from labctl.fitting.poses.moves import Moves
from labctl.fitting.poses.rotation import Rotations, change_of_direction, integrate, seen_at_end
from labctl.fitting.poses.triad import tangents


@dataclass(frozen=True)
class Equations:
    """Residuals of m moves and their derivatives; two components each, perpendicular to gravity, rad.

    A rotation about the vertical does not change the direction of gravity: two of three angles are observable.
    """

    residual: Array  #: (2m,)
    jacobian: NDArray[np.float64]  #: (2m, 9) by the errors of the gyro, row after row
    across: NDArray[np.float64]  #: (m, 2, 3) the two directions, in the body at the end
    by_turn: NDArray[np.float64]  #: (m, 2, 3) by a small rotation in the body axes at the start, rad
    rotations: Rotations

    def take(self, rows: NDArray[np.bool_]) -> Equations:
        """Return the equations of some moves, by mask (m,)."""
        both, parts = np.repeat(rows, 2), self.rotations
        rotations = Rotations(
            parts.matrix[rows], parts.by_error[rows], parts.by_bias_before[rows], parts.by_bias_after[rows],
            parts.white[rows],
        )  # fmt: skip
        return Equations(self.residual[both], self.jacobian[both], self.across[rows], self.by_turn[rows], rotations)


def equations_of(moves: Moves, accelerometer: Accelerometer, bias: Bias, errors: NDArray[np.float64]) -> Equations:
    """Return the equations of m moves at gyro errors E (3, 3)."""
    rotations = integrate(rate_without_bias(moves, bias), moves.step_s, moves.share, errors)
    up = accelerometer.up[moves.before]
    up_after = accelerometer.up[moves.before + 1]
    across = tangents(up_after)
    residual = np.einsum("mca,ma->mc", across, seen_at_end(up, rotations.matrix) - up_after)
    by_turn = across @ change_of_direction(up, rotations.matrix)
    return Equations(residual.reshape(-1), (by_turn @ rotations.by_error).reshape(-1, 9), across, by_turn, rotations)


def rate_without_bias(moves: Moves, bias: Bias) -> NDArray[np.float64]:
    """Return the outputs of m moves without the bias between the rests before and after, (m, n, 3) rad/s."""
    share = moves.share[:, :, None]
    before, after = bias.rest_dps[moves.before][:, None], bias.rest_dps[moves.before + 1][:, None]
    return np.asarray(np.radians(moves.rate_dps - (1 - share) * before - share * after))
