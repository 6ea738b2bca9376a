"""Rests in poses: the gyro's matrix from gravity before and after each move, by rotation matrices and least squares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from studies.real.independent.files import AXES, GRAVITY_M_S2, Array, Found, Value, columns_of, numbers
from studies.real.independent.rests import Session, gravity, moves, rests

XSENS, MPU = "xsens", "mpu9150"
#: The Xsens' raw words: at zero, and per deg/s.
ZERO, WORDS_PER_DPS = 32768.0, 83.3333
MPU_RATE_HZ = 100.0


def xsens() -> Session:
    """Return the session that came with imu_tk."""
    gyro, force = columns_of("xsens_gyro.parquet"), columns_of("xsens_acc.parquet")
    names = ("column 2", "column 3", "column 4")
    t_s = np.asarray(gyro["column 1"], dtype=np.float64)
    return Session(t_s, (numbers(gyro, *names) - ZERO) / WORDS_PER_DPS, numbers(force, *names))


def mpu(unit: int) -> Session:
    """Return the session of one of the three MPU-9150."""
    columns = columns_of(f"mpu9150-{unit}.parquet")
    words = numbers(columns, *(f"column {k}" for k in range(1, 7)))
    return Session(np.arange(len(words)) / MPU_RATE_HZ, np.degrees(words[:, 3:]), words[:, :3] / GRAVITY_M_S2)


def turned(rates_dps: Array, dt_s: Array) -> Array:
    """Return the rotation that body rates (n, 3) over steps (n,) make, as the matrix from the body after to before.

    Each step is Rodrigues' formula; the product is taken in pairs.
    """
    angle = np.radians(rates_dps) * dt_s[:, None]
    size = np.linalg.norm(angle, axis=1)
    x, y, z = angle.T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    safe = np.where(size > 1e-9, size, 1.0)
    first = np.where(size > 1e-9, np.sin(size) / safe, 1.0)
    second = np.where(size > 1e-9, (1 - np.cos(size)) / safe**2, 0.5)
    steps = np.eye(3) + first[:, None, None] * cross + second[:, None, None] * (cross @ cross)
    while len(steps) > 1:
        last = steps[-1:] if len(steps) % 2 else steps[:0]
        steps = np.concatenate([steps[: len(steps) // 2 * 2 : 2] @ steps[1::2], last])
    return np.asarray(steps[0])


def at_rest(session: Session, parts: list[slice], up: Array) -> tuple[Array, Array, Array]:
    """Return the mean output of each rest (m, 3), and bias (3,) with its change by g (3, 3) over all of them."""
    means = np.array([session.rates[part].mean(axis=0) for part in parts])
    solved = np.linalg.lstsq(np.column_stack([np.ones(len(up)), up]), means, rcond=None)[0]
    return means, solved[0], solved[1:].T


@dataclass(frozen=True)
class Move:
    """From one rest to the next: gravity before and after (3,), rates without bias between readings (n, 3) deg/s."""

    before: Array
    after: Array
    rates: Array
    dt_s: Array

    def off(self, matrix: Array) -> Array:
        """Return the error of gravity after the move, (3,), if output = bias + (1 + matrix) rate."""
        inverse = np.linalg.inv(np.eye(3) + matrix)
        return np.asarray(self.after - turned(self.rates @ inverse.T, self.dt_s).T @ self.before)


def moves_of(session: Session, constant_bias: Array | None = None) -> tuple[list[Move], Array]:
    """Return the moves of a session and its bias.

    The bias during a move goes from that of the rest before to that of the rest after, and changes by the specific
    force that is measured meanwhile; or it is a constant, (3,) deg/s.
    """
    parts = rests(session)
    up, matrix, offset = gravity(session, parts)
    means, bias, change = at_rest(session, parts, up)
    steady = means - up @ change.T
    force = (session.force - offset) @ matrix.T
    found = []
    for number, part in moves(parts, session):
        t_s = session.t_s[part]
        share = ((t_s - t_s[0]) / (t_s[-1] - t_s[0]))[:, None]
        drift = (1 - share) * steady[number] + share * steady[number + 1] + force[part] @ change.T
        rates = session.rates[part] - (drift if constant_bias is None else constant_bias)
        found.append(Move(up[number], up[number + 1], (rates[1:] + rates[:-1]) / 2, np.diff(t_s)))
    return found, bias


def off_by_deg(found: list[Move], matrix: Array) -> float:
    """Return the root mean square of a component (of two) of the error of gravity's direction after a move, deg."""
    left = np.concatenate([move.off(matrix) for move in found])
    return float(np.degrees(np.sqrt(left @ left / (2 * len(found)))))


def fitted(session: Session) -> tuple[Array, Array, Array, float]:
    """Return E of output = bias + (1 + E) rate, its uncertainty, the bias, and the error of gravity's direction, deg.

    The uncertainty is that of least squares by the scatter of the moves.
    """
    found, bias = moves_of(session)

    def left(parameters: Array) -> Array:
        return np.concatenate([move.off(parameters.reshape(3, 3)) for move in found])

    solved = least_squares(left, np.zeros(9), x_scale=1e-2, xtol=1e-10)
    free = 2 * len(found) - 9  # a direction has two components
    covariance = float(solved.fun @ solved.fun) / free * np.linalg.inv(solved.jac.T @ solved.jac)
    matrix = solved.x.reshape(3, 3)
    return matrix, np.sqrt(np.diag(covariance)).reshape(3, 3), bias, off_by_deg(found, matrix)


def analysis(session: Session) -> Found:
    """Return the matrix in 1e-3, the bias in deg/s, and the error of gravity's direction after a move, deg."""
    matrix, u, bias, off = fitted(session)
    found: Found = {}
    for row, axis in enumerate(AXES):
        for column, about in enumerate(AXES):
            found[f"{axis} by rate about {about}, E, 1e-3"] = Value(1e3 * matrix[row, column], 1e3 * u[row, column])
        found[f"{axis}: bias, deg/s"] = Value(float(bias[row]))
    found["gravity after a move, off by, deg"] = Value(off)
    return found


SESSIONS = {"xsens": xsens, **{f"mpu9150-{unit}": partial(mpu, unit) for unit in range(3)}}
