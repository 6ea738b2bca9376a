"""Alignment of a magnetometer to the axes of a calibrated accelerometer and gyro, from poses: one rotation.

The size of the field tells a magnetometer's hard and soft iron but no rotation. Two things tell it, without knowing the
local field: in every rest the angle between gravity and the field is the same (Kok and Schoen 2016), and in a
turn the field goes against the rate of the gyro, dm/dt = -rate x m, integrated from rest to rest (Wu et al. 2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from labctl.errors import NotEnoughData
from labctl.fitting.magnetometer.calibrate import Magnetometer
from labctl.fitting.magnetometer.ellipsoid import PLACES
from labctl.fitting.numeric.arrays import Array
from labctl.fitting.numeric.degrees_of_freedom import combined_freedom, expanded_u, information_of, scatter_by_variances
from labctl.fitting.poses.at_rest.rests import density_in_rests
from labctl.fitting.poses.between_variance import components, gls, gls_weights
from labctl.fitting.poses.covariance import level_by_parameters, level_by_reading, of_each_move, of_readings
from labctl.fitting.poses.fit import Solved
from labctl.fitting.poses.readings import AXES, PoseReadings
from labctl.fitting.poses.rotation import change_of_direction, seen_at_end
from labctl.fitting.poses.triad import cross_matrix, tangents, unit

#: Steps of the search, and the change of an angle at which it ends, rad.
STEPS, SMALL = 30, 1e-10
#: Below this change the variances of the noise are kept, rad.
SETTLED = 1e-5
#: An angle that is less certain than this is not determined, rad.
LARGEST_U = 0.02


#: Parts of the noise of r equations, (r, r), each with the degrees of freedom that it is known by.
_Estimated = list[tuple[NDArray[np.float64], float]]


@dataclass(frozen=True)
class FieldAlignment:
    """Rotation of the corrected field's axes from those of the corrected force and rate, and the dip of the field."""

    angles_rad: Array  #: (3,) rotation vector, about the accelerometer's axes, from those axes to the magnetometer's
    dip_rad: float  #: of the field below the horizontal
    covariance: NDArray[np.float64]  #: (4, 4) of angles and dip, rad^2
    u_freedom: Array  #: (4,) degrees of freedom of their standard uncertainties
    place_rad: float  #: standard deviation of a component of the direction from rest to rest, beyond the noise
    rests: int
    moves: int

    @property
    def u_rad(self) -> Array:
        """Standard uncertainty of each angle and of the dip, (4,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    @property
    def expanded_rad(self) -> Array:
        """U of each angle and of the dip for 95.45 %, (4,)."""
        return expanded_u(self.u_rad, self.u_freedom)


@dataclass(frozen=True)
class _Seen:
    """Directions of the field in k rests by the magnetometer alone, in its own corrected axes."""

    solved: Solved
    direction: NDArray[np.float64]  #: (k, 3)
    noise: NDArray[np.float64]  #: (k, 3, 3) covariance by the noise of the readings
    by_parameters: NDArray[np.float64]  #: (k, 3, 9) by hard and soft iron
    parameters: NDArray[np.float64]  #: (9, 9) their covariance
    freedom: float  #: its degrees of freedom
    readings_u: Array  #: (m,) what spacing and jitter of the readings leave of the used moves' angles, rad

    @property
    def across(self) -> NDArray[np.float64]:
        """Covariance (k, 3, 3) of a direction whose components scatter by 1 rad."""
        return np.asarray(np.eye(3) - self.direction[:, :, None] * self.direction[:, None, :])


def align_field(
    readings: PoseReadings, solved: Solved, field_ut: NDArray[np.float64], magnetometer: Magnetometer
) -> FieldAlignment:
    """Return the alignment by a calibration by hand, and by the magnetometer's readings (n, 3), uT, with theirs.

    Raises NotEnoughData where rests and turns do not determine it.
    """
    field_seen = _seen(readings, solved, field_ut, magnetometer)
    turn = _start(field_seen)
    dip = float(np.mean(np.sum(solved.accelerometer.up * (field_seen.direction @ turn.T), axis=1)))
    change, place, extra = np.inf, 0.0, 0.0
    for _ in range(STEPS):
        residual, jacobian, noise, by_place, estimated = _equations(field_seen, turn, dip)
        if change > SETTLED:
            place, extra = components(
                jacobian, residual, noise, by_place, lambda _: 0.0, float(np.mean(np.diag(noise)))
            )
        total = noise + place * by_place + extra * np.eye(len(noise))
        step, covariance = gls(jacobian, residual, total)
        turn, dip = _rotation(-step[:3]) @ turn, dip - float(step[3])
        change = float(np.abs(step).max())
        if change < SMALL:
            break
    freedom = _freedom(jacobian, total, by_place, (place, extra), estimated)
    to_dip = np.diag([1.0, 1.0, 1.0, -1 / np.sqrt(max(1 - dip**2, 1e-12))])
    result = FieldAlignment(
        _vector(turn), float(-np.arcsin(np.clip(dip, -1, 1))), to_dip @ covariance @ to_dip.T, freedom,
        float(np.sqrt(place)), int(np.count_nonzero(solved.accelerometer.used)),
        int(np.count_nonzero(solved.gyro.used)),
    )  # fmt: skip
    worst = int(np.argmax(result.u_rad[:3]))
    if result.u_rad[worst] > LARGEST_U:
        raise NotEnoughData(
            f"{readings.info.serial}: rests and turns leave the magnetometer's angle about {AXES[worst]} uncertain "
            f"by u = {np.degrees(result.u_rad[worst]):.2g} deg (limit {np.degrees(LARGEST_U):.2g} deg); record rests "
            "in more poses in the same place, away from iron"
        )
    return result


def _freedom(
    jacobian: NDArray[np.float64], total: NDArray[np.float64], by_place: NDArray[np.float64],
    variances: tuple[float, float], estimated: Sequence[tuple[NDArray[np.float64], float]],
) -> Array:  # fmt: skip
    """Return the degrees of freedom (4,) of the solution's standard uncertainties.

    What these equations tell of the scatter of the places, and of what is beyond it where that is not 0, and what the
    calibrations before them tell of theirs: `estimated` are those parts of the noise with their degrees of freedom.
    """
    weights = gls_weights(jacobian, total)

    def part(noise: NDArray[np.float64]) -> Array:
        return np.asarray(np.einsum("pi,ij,pj->p", weights, noise, weights))

    components = [by_place, *([np.eye(len(total))] if variances[1] > 0 else [])]
    scatter = scatter_by_variances(
        np.array([part(each) for each in components]), information_of(jacobian, total, components)
    )
    return combined_freedom(part(total), [(part(noise), freedom) for noise, freedom in estimated], scatter)


def _seen(readings: PoseReadings, solved: Solved, field_ut: NDArray[np.float64], magnetometer: Magnetometer) -> _Seen:
    rests = solved.rests
    means = np.array([field_ut[a:b].mean(axis=0) for a, b in zip(rests.begin, rests.end, strict=True)])
    variance = density_in_rests(field_ut, rests, readings.spacing_s) / rests.duration_s[:, None]
    away = means - magnetometer.hard_iron_ut
    field = away @ magnetometer.soft_iron
    direction = unit(field)
    across = (np.eye(3) - direction[:, :, None] * direction[:, None, :]) / np.linalg.norm(field, axis=1)[:, None, None]
    by_reading = across @ magnetometer.soft_iron
    columns = [-by_reading]
    for i, j in PLACES:
        change = np.zeros_like(away)
        change[:, i] += away[:, j]
        if i != j:
            change[:, j] += away[:, i]
        columns.append(np.einsum("kab,kb->ka", across, change)[:, :, None])
    noise = np.einsum("kai,ki,kbi->kab", by_reading, variance, by_reading)
    return _Seen(
        solved, direction, noise, np.concatenate(columns, axis=2), magnetometer.covariance[:9, :9],
        float(magnetometer.u_freedom[:9].min()),
        of_readings(solved.moves.take(solved.gyro.used), solved.bias),
    )  # fmt: skip


def _start(parts: _Seen) -> NDArray[np.float64]:
    """Return the rotation (3, 3) from the magnetometer's to the body axes by the turns: linear in its elements."""
    gyro, moves = parts.solved.gyro, parts.solved.moves
    rows = [
        np.kron(parts.direction[k], rotation.T) - np.kron(parts.direction[k + 1], np.eye(3))
        for k, rotation, used in zip(moves.before, gyro.equations.rotations.matrix, gyro.used, strict=True)
        if used
    ]
    _, _, right = np.linalg.svd(np.vstack(rows))
    matrix = right[-1].reshape(3, 3).T
    left, _, last = np.linalg.svd(matrix * np.sign(np.linalg.det(matrix)))
    return np.asarray(left @ last)


def _equations(
    field: _Seen, turn: NDArray[np.float64], dip: float
) -> tuple[Array, NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], _Estimated]:
    """Return residuals (r,), derivatives (r, 4) by turn and dip, known noise (r, r), and that by 1 rad^2 per rest.

    One residual of each used rest, two of each used move. Last come the parts of the noise that are estimated, each
    with its degrees of freedom.
    """
    solved, k = field.solved, len(field.direction)
    accelerometer, gyro, moves = solved.accelerometer, solved.gyro, solved.moves
    body, up, at_rest = field.direction @ turn.T, accelerometer.up, np.flatnonzero(accelerometer.used)
    size = len(at_rest) + 2 * int(np.count_nonzero(gyro.used))
    residual, jacobian = np.zeros(size), np.zeros((size, 4))
    by_seen, by_tilt = np.zeros((size, k, 3)), np.zeros((size, k, 3))
    by_bias, by_gyro, by_force = np.zeros((size, k, 3)), np.zeros((size, 9)), np.zeros((size, 9))
    rest_rows = np.arange(len(at_rest))
    residual[rest_rows] = np.sum(up[at_rest] * body[at_rest], axis=1) - dip
    jacobian[rest_rows, :3] = -np.einsum("ka,kab->kb", up[at_rest], cross_matrix(body[at_rest]))
    jacobian[rest_rows, 3] = -1.0
    by_seen[rest_rows, at_rest] = _across(up[at_rest], body[at_rest], dip) @ turn
    by_tilt[rest_rows, at_rest] = np.einsum("ka,kab->kb", body[at_rest], level_by_reading(accelerometer)[at_rest])
    by_force[rest_rows] = np.einsum("ka,kab->kb", body[at_rest], level_by_parameters(accelerometer)[at_rest])
    by_move = np.zeros((size, size))
    before = moves.before[gyro.used]
    parts = gyro.equations.take(gyro.used).rotations
    start, end = body[before], body[before + 1]
    across, back = tangents(end), parts.matrix.transpose(0, 2, 1)
    by_rotation = across @ change_of_direction(start, parts.matrix)
    pairs = len(at_rest) + np.arange(size - len(at_rest)).reshape(-1, 2)
    residual[pairs] = np.einsum("mca,ma->mc", across, seen_at_end(start, parts.matrix) - end)
    jacobian[pairs, :3] = across @ (cross_matrix(end) - back @ cross_matrix(start))
    by_seen[pairs, before[:, None]] = across @ back @ turn
    by_seen[pairs, before[:, None] + 1] = -across @ turn
    by_bias[pairs, before[:, None]] = by_rotation @ parts.by_bias_before
    by_bias[pairs, before[:, None] + 1] = by_rotation @ parts.by_bias_after
    by_gyro[pairs] = by_rotation @ parts.by_error
    each = of_each_move(moves.take(gyro.used), parts.white, by_rotation, field.readings_u)
    by_move[len(at_rest) :, len(at_rest) :] = block_diag(*each)

    flat = by_seen.reshape(size, -1)
    tilt = (by_tilt * accelerometer.u_rest_g[:, None]).reshape(size, -1)
    drift = (by_bias * np.radians(solved.bias.u_rest_dps)).reshape(size, -1)
    iron = np.einsum("rka,kab->rb", by_seen, field.by_parameters)
    estimated: _Estimated = [
        (iron @ field.parameters @ iron.T, field.freedom),
        (by_gyro @ gyro.covariance @ by_gyro.T, gyro.freedom),
        (tilt @ tilt.T + by_force @ accelerometer.covariance @ by_force.T, float(accelerometer.u_freedom.min())),
    ]  # fmt: skip
    noise = by_move + flat @ block_diag(*field.noise) @ flat.T + drift @ drift.T + sum(part for part, _ in estimated)
    return residual, jacobian, noise, flat @ block_diag(*field.across) @ flat.T, estimated


def _across(up: NDArray[np.float64], body: NDArray[np.float64], dip: float) -> NDArray[np.float64]:
    """Return the part of up (k, 3) across the field (k, 3), as long as the fitted dip makes it.

    As long as each rest shows it, it would give a rest whose error makes the field steeper less noise, and more weight:
    a dip that is too large.
    """
    part = up - np.sum(up * body, axis=1)[:, None] * body
    length = np.linalg.norm(part, axis=1)[:, None]
    return np.asarray(part * np.sqrt(max(1 - dip**2, 1e-12)) / np.maximum(length, 1e-12))


def _rotation(vector: Array) -> NDArray[np.float64]:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector).as_matrix())


def _vector(turn: NDArray[np.float64]) -> Array:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(turn).as_rotvec())
