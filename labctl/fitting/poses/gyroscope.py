"""Scale factors and misalignments of the gyro from moves: where gravity is at the end, by the gyro and by the rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer
from labctl.fitting.poses.at_rest.bias import Bias
from labctl.fitting.poses.between import between_variance, gls
from labctl.fitting.poses.covariance import move_covariance
from labctl.fitting.poses.determination import LEAST_MOVES
from labctl.fitting.poses.equations import Equations, equations_of
from labctl.fitting.poses.held_out import HeldOut, held_out_moves
from labctl.fitting.poses.moves import Moves

#: Steps of the search, and the change of a coefficient at which it ends.
STEPS, SMALL = 30, 1e-10
#: A good move is taken for a wrong one with this probability.
FALSE_ALARM = 1e-4
#: Median of chi squared with two degrees of freedom.
MEDIAN = 2 * float(np.log(2))
#: Rounds in which wrong moves are left out and taken in again.
ROUNDS = 12


@dataclass(frozen=True)
class Gyroscope:
    """The fitted matrix over the m moves that can be used."""

    errors: NDArray[np.float64]  #: (3, 3) E of output = bias + (I + E) rate
    covariance: NDArray[np.float64]  #: (9, 9) of E, row after row
    equations: Equations  #: of all m moves at the solution
    noise: NDArray[np.float64]  #: (2m, 2m) covariance of the residuals by what is known, rad^2
    extra_rad: float  #: standard deviation of a component beyond that, Mandel and Paule
    used: NDArray[np.bool_]  #: (m,) moves that agree with the others
    held_out: HeldOut  #: of all m moves, each by the used ones without it

    @property
    def total_of_used(self) -> NDArray[np.float64]:
        """Covariance of the residuals of the k used moves, (2k, 2k) rad^2."""
        rows = np.repeat(self.used, 2)
        return np.asarray((self.noise + self.extra_rad**2 * np.eye(len(self.noise)))[np.ix_(rows, rows)])


def fit_gyroscope(moves: Moves, accelerometer: Accelerometer, bias: Bias, readings_u: Array) -> Gyroscope:
    """Fit the nine errors by generalised least squares, without the moves that do not agree with the others.

    The moves must determine them (`determination`). `readings_u` (m,) is what `of_readings` gives, rad.
    """
    errors = _robust_start(moves, accelerometer, bias)
    used = np.ones(len(moves), dtype=np.bool_)
    seen: list[bytes] = []
    for turn in range(ROUNDS):
        equations, noise, extra, errors = _solved(moves, accelerometer, bias, readings_u, errors, used, first=turn == 0)
        held_out = held_out_moves(equations, noise + extra * np.eye(len(noise)), used)
        agrees = held_out.chi2 <= chdtri(2, FALSE_ALARM)
        if turn > 0 and (np.array_equal(agrees, used) or agrees.tobytes() in seen):
            break
        if np.count_nonzero(agrees) >= LEAST_MOVES:
            seen.append(used.tobytes())
            used = agrees
    rows = np.repeat(used, 2)
    _, covariance = gls(
        equations.jacobian[rows], equations.residual[rows], (noise + extra * np.eye(len(noise)))[np.ix_(rows, rows)]
    )
    return Gyroscope(errors, covariance, equations, noise, float(np.sqrt(extra)), used, held_out)


def _solved(
    moves: Moves, accelerometer: Accelerometer, bias: Bias, readings_u: Array, errors: NDArray[np.float64],
    used: NDArray[np.bool_], *, first: bool,
) -> tuple[Equations, NDArray[np.float64], float, NDArray[np.float64]]:  # fmt: skip
    """Return equations, known noise, variance beyond it and errors (3, 3) at the solution over the used moves.

    At first that variance is a robust one: wrong moves are still among the used.
    """
    rows = np.repeat(used, 2)
    for _ in range(STEPS):
        equations = equations_of(moves, accelerometer, bias, errors)
        noise = move_covariance(moves, accelerometer, bias, equations, readings_u)
        here = noise[np.ix_(rows, rows)]
        if first:
            extra = _robust_variance(equations, noise)
        else:
            extra = between_variance(equations.jacobian[rows], equations.residual[rows], here)
        step, _ = gls(equations.jacobian[rows], equations.residual[rows], here + extra * np.eye(len(here)))
        if first:
            break
        errors = errors - step.reshape(3, 3)
        if float(np.abs(step).max()) < SMALL:
            break
    return equations, noise, extra, errors


def _robust_variance(equations: Equations, noise: NDArray[np.float64]) -> float:
    """Return the variance of a component beyond its known noise, by the median of the moves."""
    size = np.sum(equations.residual.reshape(-1, 2) ** 2, axis=1)
    known = np.diag(noise).reshape(-1, 2).mean(axis=1)
    return float(max(np.median(size) / MEDIAN - np.median(known), 0.0))


def _robust_start(moves: Moves, accelerometer: Accelerometer, bias: Bias) -> NDArray[np.float64]:
    """Return errors (3, 3) in which a wrong move has a bounded weight: reweighted least squares, Cauchy."""
    errors = np.zeros((3, 3))
    for _ in range(STEPS):
        equations = equations_of(moves, accelerometer, bias, errors)
        size = np.linalg.norm(equations.residual.reshape(-1, 2), axis=1)
        scale = max(float(np.median(size)) / np.sqrt(MEDIAN), 1e-9)
        weight = np.repeat(1.0 / np.sqrt(1.0 + (size / (2.4 * scale)) ** 2), 2)
        step, *_ = np.linalg.lstsq(equations.jacobian * weight[:, None], equations.residual * weight)
        errors = errors - step.reshape(3, 3)
        if float(np.abs(step).max()) < 1e-7:
            break
    return errors
