"""Calibration of the accelerometer by few poses, with what an earlier calibration of the same unit knows.

Scale factors and misalignments are those of the earlier one up to its uncertainty and the change that is allowed since;
the bias, which changes from one power-on to the next, is measured anew. Both are one least squares problem (Gauss and
Markov, with the earlier estimate as six more measurements).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.freedom import combined_freedom
from labctl.fitting.poses.at_rest.accelerometer import (
    LARGEST_U,
    PARAMETERS,
    Accelerometer,
    different_poses,
    freedom_of_sizes,
    matrices,
    size_jacobian,
)
from labctl.fitting.poses.at_rest.gravity import local_gravity_g
from labctl.fitting.poses.at_rest.rests import Rests
from labctl.fitting.poses.readings import PoseReadings
from labctl.fitting.poses.triad import corrected, unit

#: Poses in different directions: one more than the three biases, so that something is left to tell a change.
MIN_POSES = 4
#: Three of the nine parameters are free.
FREE = 3
#: The rests disagree with the earlier calibration where chance makes it so in fewer cases than this.
DISAGREE = 0.01


@dataclass(frozen=True)
class Known:
    """An earlier calibration of the same accelerometer."""

    errors: Array  #: (6,) scale factors and misalignments in the order of UPPER
    covariance: NDArray[np.float64]  #: (6, 6) of them, with the change that is allowed since
    bias_g: Array  #: (3,) where the search for the new one starts
    between_var: float  #: variance between its rests beyond their noise, g^2

    @property
    def whitened(self) -> NDArray[np.float64]:
        """The matrix (6, 9) that turns a change of the nine parameters into six numbers of variance 1."""
        inverse = np.linalg.inv(np.linalg.cholesky(self.covariance))
        return np.asarray(np.hstack([np.zeros((len(inverse), FREE)), inverse]), dtype=np.float64)


@dataclass(frozen=True)
class ByFewer:
    """A calibration by few poses, and whether they agree with the earlier one."""

    found: Accelerometer
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
    _, first = _fitted(rests.accel_g, gravity, white + known.between_var, known)
    extra = known.between_var
    if first > freedom:
        extra = max(extra, _between(rests.accel_g, gravity, white, known, freedom))
    theta, _ = _fitted(rests.accel_g, gravity, white + extra, known)
    jacobian = _jacobian(theta, rests.accel_g, np.sqrt(white + extra), known)
    covariance = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    u_bias = float(np.sqrt(np.diag(covariance)[:FREE]).max())
    rank = np.linalg.matrix_rank(jacobian / np.linalg.norm(jacobian, axis=0), tol=1e-6)
    if rank < PARAMETERS or u_bias > LARGEST_U:
        raise NotEnoughData(
            f"{serial}: the poses do not determine the bias (u = {u_bias:.2g}, limit {LARGEST_U:g}): lay the unit "
            "down on opposite faces too, such as z up and z down"
        )
    errors, bias = matrices(theta)
    force = corrected(rests.accel_g, errors, bias)
    left = np.linalg.norm(force, axis=1) - gravity
    sigma, of_rests = np.sqrt(white + extra), jacobian[: len(rests)]
    by_rests = np.sum((covariance @ of_rests.T) ** 2, axis=1)
    of_sizes = freedom_of_sizes(freedom, white + known.between_var, sigma)
    found = Accelerometer(
        errors, bias, np.asarray(covariance, dtype=np.float64), unit(force), sigma,
        np.ones(len(rests), dtype=np.bool_), float(np.sqrt(np.mean(left**2))), gravity, freedom,
        combined_freedom(np.diag(covariance).astype(np.float64), [(by_rests, of_sizes)]),
    )  # fmt: skip
    return ByFewer(found, float(chdtrc(freedom, first)))


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
    found = least_squares(
        lambda theta: _residual(theta, accel_g, gravity, sigma, known),
        np.concatenate([known.bias_g, known.errors]),
        lambda theta: _jacobian(theta, accel_g, sigma, known),
        x_scale="jac",
    )
    return np.asarray(found.x, dtype=np.float64), 2 * float(found.cost)


def _between(accel_g: NDArray[np.float64], gravity: float, white: Array, known: Known, freedom: int) -> float:
    """Return the variance to add to each rest so that chi2 is what the freedom lets expect (Mandel and Paule 1970)."""
    from scipy.optimize import brentq

    def excess(variance: float) -> float:
        return _fitted(accel_g, gravity, white + variance, known)[1] - freedom

    most = float(white.max())
    while excess(most) > 0:
        most *= 10
    return 0.0 if excess(0.0) <= 0 else float(brentq(excess, 0.0, most, rtol=1e-6))
