"""Covariance of the equations of moves by what is known: noise of gyro and accelerometer, and what moves share."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer
from labctl.fitting.poses.at_rest.bias import Bias
from labctl.fitting.poses.equations import Equations, rate_without_bias
from labctl.fitting.poses.moves import Moves
from labctl.fitting.poses.rotation import integrate, integration_u
from labctl.fitting.poses.triad import UPPER


def move_covariance(
    moves: Moves, accelerometer: Accelerometer, bias: Bias, equations: Equations, readings_u: Array
) -> NDArray[np.float64]:
    """Return the covariance (2m, 2m) of the residuals, rad^2; `readings_u` (m,) is what `of_readings` gives.

    Of each rest its direction of gravity and its bias, which the moves before and after it share; of all rests the
    accelerometer's nine parameters; of each move the gyro's white noise, the jitter of its time stamps, and what the
    integration leaves.
    """
    m, rests = len(moves), len(accelerometer.up)
    before, after = moves.before, moves.before + 1
    level = level_by_reading(accelerometer)
    by_level = _by_levels(equations)
    tilt = by_level[0] @ level[before], by_level[1] @ level[after]
    by_rest = np.zeros((m, 2, rests, 6))
    rows = np.arange(m)
    by_rest[rows, :, before, :3] = tilt[0] * accelerometer.u_rest_g[before][:, None, None]
    by_rest[rows, :, after, :3] = tilt[1] * accelerometer.u_rest_g[after][:, None, None]
    u_bias = np.radians(bias.u_rest_dps)
    by_bias = (
        equations.by_turn @ equations.rotations.by_bias_before,
        equations.by_turn @ equations.rotations.by_bias_after,
    )
    by_rest[rows, :, before, 3:] += by_bias[0] * u_bias[before][:, None, :]
    by_rest[rows, :, after, 3:] += by_bias[1] * u_bias[after][:, None, :]
    shared = by_rest.reshape(2 * m, -1)
    common = by_accelerometer(moves, accelerometer, equations)
    total = shared @ shared.T + common @ accelerometer.covariance @ common.T
    of_moves = of_each_move(moves, equations.rotations.white, equations.by_turn, readings_u)
    for k in range(m):
        total[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] += of_moves[k]
    return np.asarray(total)


def level_by_reading(accelerometer: Accelerometer) -> NDArray[np.float64]:
    """Return the derivative (k, 3, 3) of the directions of gravity in k rests by the accelerometer's means."""
    inverse = np.linalg.inv(np.eye(3) + accelerometer.errors) / accelerometer.gravity_g
    up = accelerometer.up
    # only what is square to gravity changes its direction
    return np.asarray((np.eye(3) - up[:, :, None] * up[:, None, :]) @ inverse)


def level_by_parameters(accelerometer: Accelerometer) -> NDArray[np.float64]:
    """Return the derivative (k, 3, 9) of the directions of gravity in k rests by the nine parameters."""
    by_reading = level_by_reading(accelerometer)
    force = accelerometer.up * accelerometer.gravity_g
    parts = [-by_reading, *(-by_reading[:, :, i, None] * force[:, None, j, None] for i, j in UPPER)]
    return np.concatenate(parts, axis=2)


def _by_levels(equations: Equations) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the derivative (m, 2, 3) of the equations by the direction of gravity in the rest before and after."""
    return equations.across @ equations.rotations.matrix.transpose(0, 2, 1), -equations.across


def by_accelerometer(moves: Moves, accelerometer: Accelerometer, equations: Equations) -> NDArray[np.float64]:
    """Return the derivative (2m, 9) of the equations of m moves by the accelerometer's bias and errors."""
    level, (before, after) = level_by_parameters(accelerometer), _by_levels(equations)
    return np.asarray(before @ level[moves.before] + after @ level[moves.before + 1]).reshape(-1, 9)


def of_each_move(
    moves: Moves, white: NDArray[np.float64], by_turn: NDArray[np.float64], readings_u: Array
) -> NDArray[np.float64]:
    """Return the covariance (m, 2, 2) of what no two of m moves share.

    `white` (m, 3, 3) is that of `Rotations`, `by_turn` (m, 2, 3) the derivative of their equations by a small rotation.
    """
    noise = np.einsum("mab,mca,mdb->mcd", white, by_turn, by_turn)
    noise = noise * float(np.mean(moves.density)) * np.radians(1.0) ** 2
    return np.asarray(noise + readings_u[:, None, None] ** 2 * np.eye(2))


def of_readings(moves: Moves, bias: Bias) -> Array:
    """Return what spacing and jitter of the readings leave of a component of each move's angle, (m,) rad.

    Both are sizes of a rotation about any direction; a component has a third of its square.
    """
    rate = rate_without_bias(moves, bias)
    matrix = integrate(rate, moves.step_s, moves.share, np.zeros((3, 3))).matrix
    return np.asarray(
        np.hypot(integration_u(rate, moves.step_s, np.zeros((3, 3)), matrix), _jitter_angle(moves)) / np.sqrt(3.0)
    )


def _jitter_angle(moves: Moves) -> Array:
    """Return what independent errors of the time stamps make of each move's angle, (m,) rad."""
    change = np.linalg.norm(np.diff(np.radians(moves.rate_dps), axis=1), axis=2) * (moves.step_s > 0)
    return np.asarray(moves.jitter_s * np.sqrt(np.sum(change**2, axis=1)))
