"""Scale factors and misalignments of the gyro from moves: where gravity is at the end, by the gyro and by the rests."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer
from labctl.fitting.poses.at_rest.bias import Bias
from labctl.fitting.poses.between_variance import components, gls
from labctl.fitting.poses.covariance import move_covariance
from labctl.fitting.poses.determination import MIN_MOVES
from labctl.fitting.poses.equations import Equations, equations_of
from labctl.fitting.poses.held_out import HeldOut, held_out_moves
from labctl.fitting.poses.moves import Moves

#: Steps of the search, and the change of a coefficient at which it ends.
STEPS, SMALL = 30, 1e-10
#: Below this change the variances of the noise are kept: the search ends at the solution with them.
SETTLED = 1e-5
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
    freedom: int  #: degrees of freedom of its scale
    equations: Equations  #: of all m moves at the solution
    noise: NDArray[np.float64]  #: (2m, 2m) covariance of the residuals by what is known, rad^2
    extra_rad: float  #: standard deviation of a component beyond that
    used: NDArray[np.bool_]  #: (m,) moves that agree with the others
    held_out: HeldOut  #: of all m moves, each by the used ones without it

    @property
    def covariance_of_t(self) -> NDArray[np.float64]:
        """Covariance (9, 9) of the t distribution: the scale is itself estimated (JCGM 101:2008, 6.4.9.4)."""
        return self.covariance * (self.freedom / (self.freedom - 2))

    @property
    def total_of_used(self) -> NDArray[np.float64]:
        """Covariance of the residuals of the k used moves, (2k, 2k) rad^2."""
        rows = np.repeat(self.used, 2)
        return np.asarray((self.noise + self.extra_rad**2 * np.eye(len(self.noise)))[np.ix_(rows, rows)])


def fit_gyroscope(
    moves: Moves, accelerometer: Accelerometer, bias: Bias, readings_u: Array, white_g2: Array
) -> Gyroscope:
    """Fit the nine errors by generalised least squares, without the moves that do not agree with the others.

    The moves must determine them (`determination`). `readings_u` (m,) is what `of_readings` gives, rad; `white_g2`
    (k,) the variance of a component of each rest's mean by the noise of its readings.
    """
    noises = _Noises(moves, accelerometer, bias, readings_u, white_g2)
    errors = _robust_start(moves, accelerometer, bias)
    used = np.ones(len(moves), dtype=np.bool_)
    seen: list[bytes] = []
    for turn in range(ROUNDS):
        equations, noise, extra, errors = _solved(noises, errors, used, first=turn == 0)
        held_out = held_out_moves(equations, noise + extra * np.eye(len(noise)), used)
        agrees = held_out.chi2 <= chdtri(2, FALSE_ALARM)
        if turn > 0 and (np.array_equal(agrees, used) or agrees.tobytes() in seen):
            break
        if np.count_nonzero(agrees) >= MIN_MOVES:
            seen.append(used.tobytes())
            used = agrees
    rows = np.repeat(used, 2)
    _, covariance = gls(
        equations.jacobian[rows], equations.residual[rows], (noise + extra * np.eye(len(noise)))[np.ix_(rows, rows)]
    )
    freedom = accelerometer.freedom + int(np.count_nonzero(rows)) - equations.jacobian.shape[1]
    return Gyroscope(errors, covariance, freedom, equations, noise, float(np.sqrt(extra)), used, held_out)


@dataclass(frozen=True)
class _Noises:
    """What the noise of the equations of m moves depends on."""

    moves: Moves
    accelerometer: Accelerometer
    bias: Bias
    readings_u: Array  #: (m,) rad
    white_g2: Array  #: (k,)

    def equations(self, errors: NDArray[np.float64]) -> Equations:
        return equations_of(self.moves, self.accelerometer, self.bias, errors)

    def total(self, equations: Equations, pose_g2: float | None = None) -> NDArray[np.float64]:
        """Return the covariance (2m, 2m) with a variance of each pose beyond the noise; None: that of the sizes."""
        accelerometer = self.accelerometer
        if pose_g2 is not None:
            accelerometer = replace(accelerometer, u_rest_g=np.sqrt(self.white_g2 + pose_g2))
        return move_covariance(self.moves, accelerometer, self.bias, equations, self.readings_u)

    def variances(self, equations: Equations, rows: NDArray[np.bool_]) -> tuple[float, float]:
        """Return the variance of a pose beyond the noise, g^2, and that of an equation beyond all, rad^2.

        The scatter of the rests' sizes tells the first, with the accelerometer's degrees of freedom; what it makes of
        the directions of gravity the moves tell too, with 2m - 9. By the sizes alone an estimate that came out large
        stays in every equation while one that came out small is made up for by the second variance: on average that is
        too much.
        """
        variances = self.accelerometer
        k = int(np.count_nonzero(variances.used))
        freedom = variances.freedom
        white, scatter = float(self.white_g2[variances.used].mean()), variances.residual_g**2 * k
        typical = float(self.white_g2.mean())

        def sizes(pose_g2: float) -> float:
            variance = white + pose_g2
            return (freedom * np.log(variance) + scatter / variance) / 2

        known = self.total(equations, 0.0)
        by_pose = (self.total(equations, typical) - known) / typical
        both = np.ix_(rows, rows)
        start = max(scatter / max(freedom, 1) - white, white)
        return components(equations.jacobian[rows], equations.residual[rows], known[both], by_pose[both], sizes, start)


def _solved(
    noises: _Noises, errors: NDArray[np.float64], used: NDArray[np.bool_], *, first: bool
) -> tuple[Equations, NDArray[np.float64], float, NDArray[np.float64]]:
    """Return equations, known noise, variance beyond it and errors (3, 3) at the solution over the used moves.

    At first that variance is a robust one: wrong moves are still among the used.
    """
    rows = np.repeat(used, 2)
    change, pose_g2, extra = np.inf, 0.0, 0.0
    for _ in range(STEPS):
        equations = noises.equations(errors)
        if first:
            noise = noises.total(equations)
            extra = _robust_variance(equations, noise)
        else:
            if change > SETTLED:
                pose_g2, extra = noises.variances(equations, rows)
            noise = noises.total(equations, pose_g2)
        row_noise = noise[np.ix_(rows, rows)]
        step, _ = gls(equations.jacobian[rows], equations.residual[rows], row_noise + extra * np.eye(len(row_noise)))
        if first:
            break
        errors = errors - step.reshape(3, 3)
        change = float(np.abs(step).max())
        if change < SMALL:
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
