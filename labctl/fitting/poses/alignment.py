"""Alignment of the gyro triad to the accelerometer triad: one rotation, with its uncertainty.

The axes of a triad are not square to each other. Its frame is the nearest orthonormal one to the directions of its
three axes, with the sum of the squared differences as the distance (Schoenemann 1966; Loewdin 1950): no axis has a
precedence, scale factors have no influence, and the rotation between two such frames does not depend on the body axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import combined_freedom, expanded_u
from labctl.fitting.poses.at_rest.accelerometer import Accelerometer
from labctl.fitting.poses.between_variance import gls_weights
from labctl.fitting.poses.covariance import by_accelerometer
from labctl.fitting.poses.gyroscope import Gyroscope
from labctl.fitting.poses.moves import Moves
from labctl.fitting.poses.triad import UPPER, unit

#: Step of the central differences; the rotation is a smooth function of the errors of the axes.
STEP = 1e-5


@dataclass(frozen=True)
class Alignment:
    """Rotation of the gyro's frame from the accelerometer's."""

    angles_rad: Array  #: (3,) rotation vector about the accelerometer's axes, from its frame to the gyro's
    covariance: NDArray[np.float64]  #: (3, 3) of it, rad^2
    u_freedom: Array  #: (3,) degrees of freedom of the standard uncertainties

    @property
    def u_rad(self) -> Array:
        """Standard uncertainty of each angle, (3,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def expanded_rad(self) -> Array:
        """U of each angle for 95.45 %, (3,)."""
        return expanded_u(self.u_rad, self.u_freedom)


def frame_of(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frame of a triad with reading = bias + (I + errors) truth: its axes as rows, in the body, (3, 3)."""
    left, _, right = np.linalg.svd(unit(np.eye(3) + errors))
    return np.asarray(left @ right)


def rotation_between(gyro: NDArray[np.float64], accelerometer: NDArray[np.float64]) -> Array:
    """Return the rotation vector (3,), rad, that turns the accelerometer's frame to the gyro's, of errors (3, 3)."""
    from scipy.spatial.transform import Rotation

    rotation = frame_of(accelerometer) @ frame_of(gyro).T  # columns: the gyro's axes in the accelerometer's frame
    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())


def alignment_of(moves: Moves, accelerometer: Accelerometer, gyro: Gyroscope) -> Alignment:
    """Return the alignment that a calibration by m moves gives.

    An error of the accelerometer also enters the errors of the gyro, by the directions of gravity that its turns are
    compared with: the covariance is the joint one of both.
    """
    rows = np.repeat(gyro.used, 2)
    weights = gls_weights(gyro.equations.jacobian[rows], gyro.total_of_used)
    by_force = -weights @ by_accelerometer(moves, accelerometer, gyro.equations)[rows]
    shared = by_force @ accelerometer.covariance
    joint = np.block([[gyro.covariance, shared[:, 3:]], [shared[:, 3:].T, accelerometer.covariance[3:, 3:]]])
    jacobian = _jacobian(gyro.errors, accelerometer.errors)
    covariance = jacobian @ joint @ jacobian.T
    of_force = jacobian @ np.vstack([by_force, np.eye(9)[3:]])
    by_rests = np.einsum("ai,ij,aj->a", of_force, accelerometer.covariance, of_force)
    by_moves = np.maximum(np.diag(covariance) - by_rests, 0.0)
    freedom = combined_freedom(
        np.diag(covariance), [(by_rests, float(accelerometer.u_freedom.min())), (by_moves, gyro.freedom)]
    )
    return Alignment(rotation_between(gyro.errors, accelerometer.errors), covariance, freedom)


def _jacobian(gyro: NDArray[np.float64], accelerometer: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the derivative (3, 15) by the gyro's nine errors, row after row, and the accelerometer's six of UPPER."""
    columns = []
    for place in np.ndindex(3, 3):
        change = _one(place)
        columns.append(rotation_between(gyro + change, accelerometer) - rotation_between(gyro - change, accelerometer))
    for place in UPPER:
        change = _one(place)
        columns.append(rotation_between(gyro, accelerometer + change) - rotation_between(gyro, accelerometer - change))
    return np.asarray(np.column_stack(columns) / (2 * STEP))


def _one(place: tuple[int, ...]) -> NDArray[np.float64]:
    change = np.zeros((3, 3))
    change[place] = STEP
    return change
