"""Calibration of the accelerometer by gravity: in every rest the specific force has the same size.

Nine parameters (Tedaldi et al. 2014, eqs. 9 and 10; Skog and Haendel 2006): bias, scale factor and misalignment, with
the accelerometer's z axis as the body's. The direction of gravity in the body is what the gyro is compared with.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtr

from labctl.errors import NotEnoughData
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import expanded_u, freedom_of_bounded, student_factor
from labctl.fitting.poses.at_rest.gravity import local_gravity_g
from labctl.fitting.poses.at_rest.rests import Rests
from labctl.fitting.poses.between_variance import between_variance
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.triad import UPPER, corrected, unit

PARAMETERS = 3 + len(UPPER)
#: Rests in different directions that nine parameters take at least: some must be left to tell how well they fit.
MIN_POSES = 12
#: Directions closer than this count as one pose, deg.
SAME_POSE_DEG = 5.0
#: A face counts as laid up where a pose is nearer to it than this, deg.
FACE_DEG = 30.0
#: A scale factor or misalignment that is less certain than this is not determined, and so a bias in g.
LARGEST_U = 0.02
#: In a rest whose gravity is off by more than this many standard deviations the unit moved; by an estimated one, as far
#: as Student's t is as unlikely.
WRONG = 5.0
WRONG_LEVEL = float(chdtr(1, WRONG**2))
#: Rounds in which wrong rests are left out and taken in again.
ROUNDS = 8


@dataclass(frozen=True)
class Accelerometer:
    """A calibrated accelerometer, and the directions of gravity in the rests."""

    errors: NDArray[np.float64]  #: (3, 3) scale factor errors on the diagonal, misalignments above it
    bias_g: Array  #: (3,)
    covariance: NDArray[np.float64]  #: (9, 9) of the bias, then of the errors in the order of UPPER
    up: NDArray[np.float64]  #: (k, 3) direction of the specific force in each rest
    u_rest_g: Array  #: (k,) standard uncertainty of a component of each rest's mean
    used: NDArray[np.bool_]  #: (k,) rests that agree with gravity
    residual_g: float  #: root mean square of what is left of the rests' sizes
    gravity_g: float
    freedom: int  #: used rests, and what was known before, beyond the parameters
    u_freedom: Array  #: (9,) degrees of freedom of the standard uncertainties

    @property
    def u(self) -> Array:
        """Standard uncertainties in the order of `covariance`, (9,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def expanded(self) -> Array:
        """U for 95.45 %, (9,)."""
        return expanded_u(self.u, self.u_freedom)


def calibrate_accelerometer(readings: PoseReadings, rests: Rests) -> Accelerometer:
    """Fit the nine parameters. Raises NotEnoughData where the poses do not determine them, with what to do."""
    require_poses(readings.info.serial, rests)
    gravity = local_gravity_g(readings.info)
    law = SizeLaw(rests.accel_g)
    white = rests.accel_white_var.mean(axis=1)
    theta, sigma, used = fit_sizes(law, gravity, white, MIN_POSES)
    jacobian = _jacobian(theta, rests.accel_g[used]) / sigma[used][:, None]
    covariance = _covariance(readings.info.serial, jacobian, rests.accel_g[used])
    left = _sizes(theta, rests.accel_g[used]) - gravity
    errors, bias = matrices(theta)
    freedom = int(np.count_nonzero(used)) - PARAMETERS
    return Accelerometer(
        errors, bias, covariance, unit(corrected(rests.accel_g, errors, bias)), sigma, used,
        float(np.sqrt(np.mean(left**2))), gravity, freedom,
        np.full(PARAMETERS, freedom_of_sizes(freedom, white[used], sigma[used])),
    )  # fmt: skip


def freedom_of_sizes(freedom: int, white: Array, sigma: Array) -> float:
    """Return the degrees of freedom of the variance (k,) of sizes, sigma^2, which is `white` (k,) at least."""
    return freedom_of_bounded(freedom, float(white.mean() / np.mean(sigma**2)))


class Law(Protocol):
    """Sizes of the forces behind the means of k rests, by parameters, and their derivative."""

    @property
    def parameters(self) -> int: ...
    def take(self, rows: NDArray[np.bool_]) -> Law: ...
    def sizes(self, theta: Array) -> Array: ...
    def jacobian(self, theta: Array) -> NDArray[np.float64]: ...


@dataclass(frozen=True)
class SizeLaw:
    """The nine parameters, the same in all k rests."""

    accel_g: NDArray[np.float64]  #: (k, 3)
    parameters = PARAMETERS

    def take(self, rows: NDArray[np.bool_]) -> SizeLaw:
        return SizeLaw(self.accel_g[rows])

    def sizes(self, theta: Array) -> Array:
        return _sizes(theta, self.accel_g)

    def jacobian(self, theta: Array) -> NDArray[np.float64]:
        return _jacobian(theta, self.accel_g)

    @staticmethod
    def columns(pull: NDArray[np.float64], force: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the derivative (k, 9) of the sizes of forces (k, 3), which an error of a reading changes by `pull`."""
        return np.column_stack([pull, *(pull[:, i] * force[:, j] for i, j in UPPER)])


def fit_sizes(law: Law, gravity: float, white: Array, least: int) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return the parameters that make the sizes gravity, the standard uncertainty (k,) of a size, and which are used.

    Rests that do not agree with gravity are left out, as long as `least` are kept. `white` (k,) is the variance of each
    mean by its noise, g^2.
    """
    k = len(white)
    used = np.ones(k, dtype=np.bool_)
    theta = _fitted(law, gravity, np.ones(k), robust=True)
    for turn in range(ROUNDS):
        residual, jacobian = law.sizes(theta) - gravity, law.jacobian(theta)
        extra = between_variance(jacobian[used], residual[used], np.diag(white[used]))
        sigma = np.sqrt(white + extra)
        # at first a wrong rest would hide in the scatter that it makes itself
        usual = 1.4826 * float(np.median(np.abs(residual))) * np.sqrt(k / max(k - law.parameters, 1))
        wrong = (
            np.abs(residual) > WRONG * np.hypot(usual, np.sqrt(white))
            if turn == 0
            else _is_wrong(jacobian, residual, sigma, used, white)
        )
        if (turn > 0 and np.array_equal(wrong, ~used)) or np.count_nonzero(~wrong) < least:
            break
        used = ~wrong
        theta = _fitted(law.take(used), gravity, sigma[used], robust=False, start=theta)
    return _fitted(law.take(used), gravity, sigma[used], robust=False, start=theta), sigma, used


def _is_wrong(
    jacobian: NDArray[np.float64], residual: Array, sigma: Array, used: NDArray[np.bool_], white: Array
) -> NDArray[np.bool_]:
    """Return which rests (k,) do not agree with the others: by residuals of fits without them (deletion residuals).

    A rest that is left out is predicted, and the prediction of few rests is uncertain; one that is used has drawn the
    fit to itself (Cook and Weisberg 1982, section 2.2).
    """
    rows = jacobian / sigma[:, None]
    covariance = np.linalg.pinv(rows[used].T @ rows[used], hermitian=True)
    leverage = np.einsum("ki,ij,kj->k", rows, covariance, rows)
    standard = (residual / sigma) ** 2 / np.where(used, np.maximum(1 - leverage, 1e-9), 1 + leverage)
    freedom = freedom_of_sizes(int(np.count_nonzero(used)) - jacobian.shape[1], white[used], sigma[used])
    # the scatter counts without the rest itself
    others = np.maximum(freedom - standard, 1e-9) / max(freedom - 1, 1e-9)
    standard = np.where(used, standard / others, standard)
    return np.asarray(standard > student_factor(freedom, WRONG_LEVEL) ** 2)


def matrices(theta: Array) -> tuple[NDArray[np.float64], Array]:
    """Return errors (3, 3) and bias (3,) of the nine parameters."""
    errors = np.zeros((3, 3))
    for value, place in zip(theta[3:], UPPER, strict=True):
        errors[place] = value
    return errors, theta[:3]


def _sizes(theta: Array, accel_g: NDArray[np.float64]) -> Array:
    return np.asarray(np.linalg.norm(corrected(accel_g, *matrices(theta)), axis=1))


def _jacobian(theta: Array, accel_g: NDArray[np.float64]) -> NDArray[np.float64]:
    return size_jacobian(*matrices(theta), accel_g)


def size_jacobian(errors: NDArray[np.float64], bias: Array, accel_g: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivative of the sizes of forces behind readings (k, 3) by the nine parameters, (k, 9)."""
    inverse = np.linalg.inv(np.eye(3) + errors)
    force = corrected(accel_g, errors, bias)
    pull = -unit(force) @ inverse  # what one g of error in a reading changes of the size
    return SizeLaw.columns(pull, force)


def _fitted(law: Law, gravity: float, sigma: Array, *, robust: bool, start: Array | None = None) -> Array:
    """Return the parameters by least squares; robust: a rest in which the unit moved has a bounded influence."""
    from scipy.optimize import least_squares

    begin = np.zeros(law.parameters) if start is None else start
    scale = 1.0
    if robust:
        first = least_squares(lambda theta: law.sizes(theta) - gravity, begin, law.jacobian)
        scale = max(1.4826 * float(np.median(np.abs(first.fun))), 1e-9)
        begin = first.x
    solution = least_squares(
        lambda theta: (law.sizes(theta) - gravity) / sigma,
        begin,
        lambda theta: law.jacobian(theta) / sigma[:, None],
        loss="cauchy" if robust else "linear",
        f_scale=scale,
        x_scale="jac",
    )
    return np.asarray(solution.x, dtype=np.float64)


def different_poses(directions: NDArray[np.float64]) -> int:
    """Return how many directions (k, 3) are further than SAME_POSE_DEG from each other."""
    kept: list[NDArray[np.float64]] = []
    limit = np.cos(np.radians(SAME_POSE_DEG))
    for each in unit(directions):
        if all(float(each @ other) < limit for other in kept):
            kept.append(each)
    return len(kept)


def require_poses(serial: str, rests: Rests) -> None:
    """Raise NotEnoughData for rests in fewer than MIN_POSES different poses, with the faces that none has up."""
    poses = different_poses(rests.accel_g)
    if poses < MIN_POSES:
        raise NotEnoughData(
            f"{serial}: {len(rests)} rests in {poses} different poses; the accelerometer, by which the gyro is "
            f"calibrated, needs at least {MIN_POSES} for bias, scale factor and misalignment: lay the unit down "
            "for 2 s "
            "or more on each face, each edge and some corners"
            f"{_missing(rests.accel_g)}; free motion without rests is no reference"
        )


def _missing(accel_g: NDArray[np.float64]) -> str:
    """Return the faces that no pose has up within FACE_DEG, in words."""
    nearest = _faces(accel_g)
    absent = [name for name, cosine in nearest.items() if cosine < np.cos(np.radians(FACE_DEG))]
    return f" (no pose yet with {', '.join(absent)} up)" if absent else ""


def _faces(accel_g: NDArray[np.float64]) -> dict[str, float]:
    """Return the cosine between each face's direction and the nearest pose."""
    directions = unit(accel_g)
    return {
        f"{sign}{a}": float((s * directions[:, i]).max())
        for i, a in enumerate(AXES)
        for sign, s in (("", 1), ("-", -1))
    }


def _covariance(serial: str, jacobian: NDArray[np.float64], accel_g: NDArray[np.float64]) -> NDArray[np.float64]:
    covariance = np.linalg.pinv(jacobian.T @ jacobian, hermitian=True)
    rank = np.linalg.matrix_rank(jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300), tol=1e-6)
    u = np.sqrt(np.diag(covariance))
    if rank == PARAMETERS and float(u.max()) <= LARGEST_U:
        return np.asarray(covariance, dtype=np.float64)
    faces = _faces(accel_g)
    face = min(faces, key=lambda name: faces[name])
    raise NotEnoughData(
        f"{serial}: the poses do not determine the accelerometer's nine parameters (the least certain has u = "
        f"{float(u.max()) if rank == PARAMETERS else np.inf:.2g}, limit {LARGEST_U:g}): lay the unit down with {face} "
        f"up too (the nearest pose is {np.degrees(np.arccos(np.clip(faces[face], -1, 1))):.0f} deg from it), and on "
        "edges and corners"
    )
