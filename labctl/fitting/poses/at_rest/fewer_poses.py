"""Calibration of the accelerometer by few poses, with what an earlier calibration of the same unit knows.

Scale factors and misalignments are those of the earlier one up to its uncertainty and the change that is allowed since;
the bias, which changes from one power-on to the next, is measured anew. Both are one least squares problem (Gauss and
Markov, with the earlier estimate as six more measurements).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import combined_freedom, information_of, scatter_by_variances
from labctl.fitting.poses.at_rest.accelerometer import (
    LARGEST_U,
    PARAMETERS,
    Accelerometer,
    different_poses,
    matrices,
    size_jacobian,
)
from labctl.fitting.poses.at_rest.gravity import local_gravity_g
from labctl.fitting.poses.at_rest.rests import Rests
from labctl.fitting.poses.between_variance import negative_log_restricted_likelihood
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import corrected, unit

#: Poses in different directions: one more than the three biases, so that something is left to tell a change.
MIN_POSES = 4
#: Three of the nine parameters are free.
FREE = 3
#: The rests disagree with the earlier calibration where chance makes it so in fewer cases than this.
DISAGREE = 0.01
#: Standard uncertainties of a bias that the forces have at least along it: of four standard deviations, twice.
MIN_LIFT = 8.0
#: Rounds of parameters and variance between rests by turns, and the root of the variance that is looked for at most,
#: over what is left of the rests.
ROUNDS, MAX_ROOT = 2, 10.0


@dataclass(frozen=True)
class Scatter:
    """How the sizes of gravity scattered in the rests of an earlier session."""

    variance_g2: float  #: of a size, by all there was
    noise_g2: float  #: the part of it that the noise of a mean makes
    freedom: float  #: degrees of freedom of `variance_g2`

    @property
    def between_g2(self) -> float:
        """Variance of a rest beyond the noise of its mean, g^2."""
        return max(self.variance_g2 - self.noise_g2, 0.0)

    def negative_log_likelihood(self, between_g2: float) -> float:
        """Return minus the logarithm of the likelihood of a variance between rests, without its constant."""
        total = max(self.noise_g2 + between_g2, 1e-30)
        return self.freedom / 2 * (math.log(total) + self.variance_g2 / total)

    def information(self, between_g2: float) -> float:
        """Return what that session tells of it, 1/g^4."""
        return self.freedom / 2 / max(self.noise_g2 + between_g2, 1e-30) ** 2


@dataclass(frozen=True)
class Known:
    """An earlier calibration of the same accelerometer."""

    errors: Array  #: (6,) scale factors and misalignments in the order of UPPER
    covariance: NDArray[np.float64]  #: (6, 6) of them, with the change that is allowed since
    bias_g: Array  #: (3,) where the search for the new one starts
    scatter: Scatter | None = None  #: of its rests; None: these rests alone tell theirs

    @property
    def whitened(self) -> NDArray[np.float64]:
        """The matrix (6, 9) that turns a change of the nine parameters into six numbers of variance 1."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.covariance))
        return np.asarray(np.hstack([np.zeros((len(inverse), FREE)), inverse]), dtype=np.float64)


@dataclass(frozen=True)
class ByFewer:
    """A calibration by few poses, and whether they agree with the earlier one."""

    accelerometer: Accelerometer
    p_value: float  #: of rests and earlier calibration together; small: they disagree

    @property
    def agrees(self) -> bool:
        return self.p_value >= DISAGREE


def by_fewer_poses(readings: PoseReadings, rests: Rests, known: Known) -> ByFewer:
    """Fit the nine parameters to rests and an earlier calibration; no rest is left out.

    Raises NotEnoughData where the poses do not determine the bias, with what to do.
    """
    poses, serial = different_poses(rests.accel_g), readings.info.serial
    if poses < MIN_POSES:
        raise NotEnoughData(
            f"{serial}: {len(rests)} rests in {poses} different poses; with an earlier version the accelerometer needs "
            f"at least {MIN_POSES}: lay the unit down for 2 s or more on further faces"
        )
    gravity, white = local_gravity_g(readings.info), rests.accel_white_var.mean(axis=1)
    freedom = len(rests) - FREE
    earlier = known.scatter.between_g2 if known.scatter else 0.0
    theta, chi2 = _fitted(rests.accel_g, gravity, white + earlier, known)
    p_value = _chance(chi2, freedom, known.scatter)
    for _ in range(ROUNDS):
        extra = _between(theta, rests.accel_g, gravity, white, known)
        theta, _ = _fitted(rests.accel_g, gravity, white + extra, known)
    jacobian = _jacobian(theta, rests.accel_g, np.sqrt(white + extra), known)
    covariance = np.asarray(np.linalg.pinv(jacobian.T @ jacobian, hermitian=True), dtype=np.float64)
    u_bias = float(np.sqrt(np.diag(covariance)[:FREE]).max())
    rank = np.linalg.matrix_rank(jacobian / np.linalg.norm(jacobian, axis=0), tol=1e-6)
    if rank < PARAMETERS or u_bias > LARGEST_U:
        raise NotEnoughData(
            f"{serial}: the poses do not determine the bias (u = {u_bias:.2g}, limit {LARGEST_U:g}): lay the unit "
            "down on opposite faces too, such as z up and z down"
        )
    errors, bias = matrices(theta)
    force = corrected(rests.accel_g, errors, bias)
    _require_out_of_plane(serial, force, covariance[:FREE, :FREE])
    left = np.linalg.norm(force, axis=1) - gravity
    sigma = np.sqrt(white + extra)
    accelerometer = Accelerometer(
        errors, bias, covariance, unit(force), sigma,
        np.ones(len(rests), dtype=np.bool_), float(np.sqrt(np.mean(left**2))), gravity, freedom,
        _freedom(jacobian, covariance, sigma, extra, known),
    )  # fmt: skip
    return ByFewer(accelerometer, p_value)


def _require_out_of_plane(serial: str, force: NDArray[np.float64], bias_covariance: NDArray[np.float64]) -> None:
    """Raise NotEnoughData where the forces (k, 3) lie too near to one plane for the bias square to it.

    A bias b changes a size by its component along the force, and by b^2 / 2 where it is square to the force. Near the
    plane the second is not small: a difference of size d is explained by b = +-sqrt(2 d), which lifts all forces out of
    the plane by b with u = u_d / b, so that b / u = 2 d / u_d is no more than chance makes it.
    """
    variances, directions = np.linalg.eigh(bias_covariance)
    worst, u = directions[:, -1], float(np.sqrt(max(variances[-1], 0.0)))
    lifted = float(np.sqrt(np.mean((force @ worst) ** 2)))
    if lifted < MIN_LIFT * u:
        axis = AXES[int(np.argmax(np.abs(worst)))]
        raise NotEnoughData(
            f"{serial}: the poses lie in one plane but for {lifted:.2g} g, and do not determine the bias of {axis} (u "
            f"= {u:.2g} g, limit {lifted / MIN_LIFT:.2g} g): lay the unit down with {axis} up and with {axis} down too"
        )


def _chance(chi2: float, freedom: int, scatter: Scatter | None) -> float:
    """Return how often chance leaves as much chi2 of the rests: by the scatter of an earlier session, F distributed."""
    if scatter is None:
        return float(chdtrc(freedom, chi2))
    return float(fdtrc(freedom, max(scatter.freedom, 1.0), chi2 / freedom))


def _freedom(
    jacobian: NDArray[np.float64], covariance: NDArray[np.float64], sigma: Array, between_g2: float, known: Known
) -> Array:
    """Return the degrees of freedom (9,) of the standard uncertainties: the variance between rests is estimated.

    `jacobian` (m, 9) is that of numbers of variance 1, of k rests first.
    """
    by_variance = np.concatenate([1 / sigma**2, np.zeros(len(jacobian) - len(sigma))])
    information = information_of(jacobian, np.eye(len(jacobian)), [np.diag(by_variance)])
    if known.scatter is not None:
        information = information + known.scatter.information(between_g2)
    slopes = np.sum((covariance @ jacobian.T) ** 2 * by_variance, axis=1)[None]
    return combined_freedom(np.diag(covariance), [], scatter_by_variances(slopes, information))


def _residual(
    theta: Array, accel_g: NDArray[np.float64], gravity: float, sigma: Array, known: Known
) -> NDArray[np.float64]:
    sizes = np.linalg.norm(corrected(accel_g, *matrices(theta)), axis=1)
    change = known.whitened @ (theta - np.concatenate([np.zeros(FREE), known.errors]))
    return np.concatenate([(sizes - gravity) / sigma, change])


def _jacobian(theta: Array, accel_g: NDArray[np.float64], sigma: Array, known: Known) -> NDArray[np.float64]:
    return np.vstack([size_jacobian(*matrices(theta), accel_g) / sigma[:, None], known.whitened])


def _fitted(accel_g: NDArray[np.float64], gravity: float, variance: Array, known: Known) -> tuple[Array, float]:
    """Return the nine parameters and the chi2 that they leave of rests and earlier calibration."""
    from scipy.optimize import least_squares

    sigma = np.sqrt(variance)
    solution = least_squares(
        lambda theta: _residual(theta, accel_g, gravity, sigma, known),
        np.concatenate([known.bias_g, known.errors]),
        lambda theta: _jacobian(theta, accel_g, sigma, known),
        x_scale="jac",
    )
    return np.asarray(solution.x, dtype=np.float64), 2 * float(solution.cost)


def _between(theta: Array, accel_g: NDArray[np.float64], gravity: float, white: Array, known: Known) -> float:
    """Return the variance between rests beyond their noise `white` (k,), g^2, that is the likeliest.

    By the restricted likelihood of these rests (Patterson and Thompson 1971) times that of the earlier session's.
    """
    from scipy.optimize import minimize_scalar

    ones = np.ones(len(white))
    jacobian, residual = _jacobian(theta, accel_g, ones, known), _residual(theta, accel_g, gravity, ones, known)
    scale = math.sqrt(float(np.mean(residual[: len(white)] ** 2)) + float(white.mean()))
    if known.scatter is not None:
        scale = max(scale, math.sqrt(known.scatter.variance_g2))

    def negative_log_likelihood(root: float) -> float:
        between = (root * scale) ** 2
        total = np.concatenate([white + between, np.ones(len(residual) - len(white))])
        of_earlier = 0.0 if known.scatter is None else known.scatter.negative_log_likelihood(between)
        return negative_log_restricted_likelihood(jacobian, residual, np.diag(total)) + of_earlier

    minimum = minimize_scalar(
        negative_log_likelihood, bounds=(1e-6, MAX_ROOT), method="bounded", options={"xatol": 1e-4}
    )
    return float((minimum.x * scale) ** 2)
