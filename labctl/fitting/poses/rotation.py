"""Rotation of the body over each move, integrated from the gyro, and what it depends on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.triad import cross_matrix


@dataclass(frozen=True)
class Rotations:
    """m moves: rotations from the body axes at the end to those at the start, and their derivatives.

    A derivative is that of a small rotation in the body axes at the start, rad.
    """

    matrix: NDArray[np.float64]  #: (m, 3, 3)
    by_error: NDArray[np.float64]  #: (m, 3, 9) per unit of E, row after row
    by_bias_before: NDArray[np.float64]  #: (m, 3, 3) per rad/s of bias at the start, fading to the end
    by_bias_after: NDArray[np.float64]  #: (m, 3, 3) per rad/s of bias at the end
    white: NDArray[np.float64]  #: (m, 3, 3) covariance per (rad/s)^2 s of white noise of each axis alike


def integrate(
    rate: NDArray[np.float64], step_s: NDArray[np.float64], share: NDArray[np.float64], errors: NDArray[np.float64]
) -> Rotations:
    """Integrate outputs (m, n, 3), rad/s and already without bias, at n times with n - 1 steps (m, n - 1), s.

    A move that is shorter is filled up with steps of 0 s. `share` (m, n) is how much of the bias is that of the end.
    The rate is taken as linear over each step, with the commutator of fourth order (Magnus expansion).
    """
    inverse = np.linalg.inv(np.eye(3) + errors)
    vectors, mean = _steps(rate @ inverse.T, step_s)
    half = _matrices(vectors / 2)
    middle = np.empty_like(half)
    matrix = np.broadcast_to(np.eye(3), (len(rate), 3, 3)).copy()
    for k in range(vectors.shape[1]):  # of all moves at once: a product goes step by step
        middle[:, k] = matrix @ half[:, k]
        matrix = middle[:, k] @ half[:, k]
    to_start = middle @ inverse  # (m, n, 3, 3): from an error in the outputs' axes to one in the body axes at the start
    weight = (share[:, :-1] + share[:, 1:]) / 2 * step_s
    by_error = -np.einsum("mkai,mkj->maij", to_start, mean).reshape(len(rate), 3, 9)
    return Rotations(
        matrix,
        by_error,
        -np.einsum("mkai,mk->mai", to_start, step_s - weight),
        -np.einsum("mkai,mk->mai", to_start, weight),
        np.einsum("mkai,mkbi,mk->mab", to_start, to_start, step_s),
    )


def _steps(true: NDArray[np.float64], step_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the rotation vector of each step (m, n - 1, 3), rad, and its part that is linear in the rate."""
    before, after, dt = true[:, :-1], true[:, 1:], step_s[:, :, None]
    mean = (before + after) / 2 * dt
    return mean + np.cross(before, after) * dt**2 / 12, mean


def _matrices(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.spatial.transform import Rotation

    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape[:2], 3, 3)


def integration_u(
    rate: NDArray[np.float64], step_s: NDArray[np.float64], errors: NDArray[np.float64], matrix: NDArray[np.float64]
) -> Array:
    """Return what the spacing of the readings leaves of each rotation `matrix` (m, 3, 3), (m,) rad.

    By the rotations of every second and every fourth reading: how much faster the second differ less tells the order of
    convergence (between 2 and 4), and that how much of the difference is left (Roache 1994).
    """
    inverse = np.linalg.inv(np.eye(3) + errors)
    second, fourth = (_coarse(rate @ inverse.T, step_s, every) for every in (2, 4))
    near, far = _angle_between(second, matrix), _angle_between(fourth, second)
    ratio = np.sqrt(np.sum(far**2) / max(float(np.sum(near**2)), 1e-300))
    return np.asarray(near / (np.clip(ratio, *CONVERGENCE) - 1.0))


#: Least and most that the error of an integration falls by at half the step: of second order, and of fourth.
CONVERGENCE = (4.0, 16.0)


def _coarse(true: NDArray[np.float64], step_s: NDArray[np.float64], step: int) -> NDArray[np.float64]:
    """Return the rotations (m, 3, 3) by every so many readings of true rates (m, n, 3), and the last of each move."""
    keep = np.unique(np.append(np.arange(0, true.shape[1], step), true.shape[1] - 1))
    longer_s = np.add.reduceat(step_s, keep[:-1], axis=1)
    last = np.maximum(np.count_nonzero(step_s, axis=1), 1)  # the reading at which a move ends, before it is filled up
    rows, kept_rows = np.arange(len(true)), true[:, keep].copy()
    kept_rows[rows, np.searchsorted(keep, last)] = true[rows, last]
    vectors, _ = _steps(kept_rows, longer_s)
    steps = _matrices(vectors)
    rotation = np.broadcast_to(np.eye(3), (len(true), 3, 3)).copy()
    for k in range(vectors.shape[1]):
        rotation = rotation @ steps[:, k]
    return rotation


def _angle_between(first: NDArray[np.float64], second: NDArray[np.float64]) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(first.transpose(0, 2, 1) @ second).magnitude())


def change_of_direction(up: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivative (m, 3, 3) of directions `up` (m, 3), seen in the body at the end, by a small rotation."""
    return np.asarray(matrix.transpose(0, 2, 1) @ cross_matrix(up))


def seen_at_end(up: NDArray[np.float64], matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return directions (m, 3), given in the body axes at the start, in the body axes at the end."""
    return np.asarray(np.einsum("mji,mj->mi", matrix, up))


def angle_deg(rate: NDArray[np.float64], step_s: NDArray[np.float64]) -> Array:
    """Return how far each move turned, all turns added, (m,) deg, by outputs (m, n, 3), rad/s."""
    size = np.linalg.norm((rate[:, :-1] + rate[:, 1:]) / 2, axis=2)
    return np.asarray(np.degrees(np.sum(size * step_s, axis=1)))
