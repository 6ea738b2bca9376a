"""Gyro, accelerometer and magnetometer turned by hand between rests, made with NumPy only: no formula of the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

Array = np.ndarray
RATE_HZ, REST_S, TURN_S = 100.0, 2.5, 2.0
GYRO_NOISE_DPS, FORCE_NOISE_G, FIELD_NOISE_UT = 0.05, 0.002, 0.3
DIP_DEG, FIELD_UT = 64.0, 49.0


@dataclass(frozen=True)
class TrueTriads:
    """reading = bias + matrix truth, the truth along the body axes; field readings = hard iron + matrix field."""

    gyro: Array  #: (3, 3)
    gyro_bias_dps: Array  #: (3,)
    force: Array  #: (3, 3), upper triangle
    force_bias_g: Array  #: (3,)
    field: Array  #: (3, 3) the inverse of a symmetric matrix of determinant 1, times the turn below
    hard_iron_ut: Array  #: (3,)
    turned: Array  #: (3, 3) from the body axes to those of the corrected field

    @staticmethod
    def drawn(rng: np.random.Generator) -> TrueTriads:
        """Return a unit of the size that MEMS sensors have; the magnetometer is turned by some degrees."""
        soft = np.eye(3) + symmetric(rng.normal(0, 0.04, (3, 3)))
        soft /= np.cbrt(np.linalg.det(soft))
        turned = rotation(rng.normal(0, 0.06, 3))
        return TrueTriads(
            np.eye(3) + rng.normal(0, 0.01, (3, 3)), rng.normal(0, 1, 3),
            np.eye(3) + np.triu(rng.normal(0, 0.01, (3, 3))), rng.normal(0, 0.03, 3),
            np.linalg.inv(soft) @ turned.T, rng.normal(0, 15, 3), turned,
        )  # fmt: skip


def symmetric(matrix: Array) -> Array:
    """Return the symmetric part of a matrix (3, 3)."""
    return np.asarray((matrix + matrix.T) / 2)


def rotation(vector: Array) -> Array:
    """Return the rotation by a rotation vector (3,), rad (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def vector_of(turn: Array) -> Array:
    """Return the rotation vector (3,), rad, of a rotation by less than 90 deg: its logarithm as a series."""
    away, log, power = turn - np.eye(3), np.zeros((3, 3)), np.eye(3)
    for k in range(1, 60):
        power = power @ away
        log -= (-1.0) ** k * power / k
    return np.array([log[2, 1], log[0, 2], log[1, 0]])


def turned_by_hand(
    seed: int, unit: TrueTriads, rests: int, pose_g: float = 0.0002, place_ut: float = 0.0, on_way: bool = True
) -> tuple[Array, Array, Array, Array]:
    """Return time (n,), s, outputs (n, 3) of the gyro, deg/s, and of the accelerometer, g, and field (n, 3), uT.

    `pose_g` and `place_ut` are errors of force and field that are others in each rest. Poses are spread over the
    sphere; from one to the next the unit is turned about a fixed axis of the body, slow at both ends, and the error of
    the field goes from one place's to the next's: iron near the unit adds to the field of the room. Not `on_way`: the
    field is without an error while the unit is turned.
    """
    rng = np.random.default_rng(seed)
    still, moving = round(REST_S * RATE_HZ), round(TURN_S * RATE_HZ)
    share = np.arange(1, moving) / moving
    speed = 30 * share**2 * (1 - share) ** 2 / TURN_S  # of the share s^3 (10 - 15 s + 6 s^2)
    angle = share**3 * (10 - 15 * share + 6 * share**2)
    up, north = np.array([0.0, 0.0, 1.0]), np.radians(DIP_DEG)
    field = FIELD_UT * np.array([np.cos(north), 0.0, -np.sin(north)])
    at = _spread(rng, 0)
    rates, forces, poses, places = [], [], [], []
    for k in range(rests):
        rates.append(np.zeros((still, 3)))
        forces.append(np.tile(at.T @ up + rng.normal(0, pose_g, 3), (still, 1)))
        places.append(rng.normal(0, place_ut, 3))
        poses.append([at] * still)
        if k + 1 == rests:
            break
        turn = _turn_to(at, _spread(rng, k + 1))
        turned = [at @ rotation(part * turn) for part in angle]
        rates.append(np.degrees(speed[:, None] * turn))
        shaking = 0.2 * np.sin(2 * np.pi * share[:, None] * np.array([2.0, 3.0, 5.0]))
        forces.append(np.array([each.T @ up for each in turned]) + shaking)
        poses.append(turned)
        at = at @ rotation(turn)
    rate, force = np.vstack(rates), np.vstack(forces)
    added = [np.tile(places[0], (still, 1))]
    for one, following in pairwise(places):
        added.append(on_way * (np.outer(1 - share, one) + np.outer(share, following)))
        added.append(np.tile(following, (still, 1)))
    seen = np.einsum("nij,ni->nj", np.concatenate(poses), field + np.vstack(added))
    n = len(rate)
    return (
        np.arange(n) / RATE_HZ,
        unit.gyro_bias_dps + rate @ unit.gyro.T + rng.normal(0, GYRO_NOISE_DPS, (n, 3)),
        unit.force_bias_g + force @ unit.force.T + rng.normal(0, FORCE_NOISE_G, (n, 3)),
        unit.hard_iron_ut + seen @ unit.field.T + rng.normal(0, FIELD_NOISE_UT, (n, 3)),
    )


def warmed_k(n: int) -> Array:
    """Return what the temperature of n readings is from the middle, K: four levels, with a slow change in each."""
    share = np.arange(n) / n
    return np.asarray(np.array([-30.0, -10.0, 10.0, 30.0])[(4 * share).astype(np.int64)] + 2 * share)


@dataclass(frozen=True)
class Warming:
    """What bias and scale factors of an accelerometer change with the temperature, from that of the unit as drawn."""

    bias_g: Array  #: (3, 3) by power 1 to 3 and axis, g/K^k
    scale_factor: Array  #: (3,) 1/K

    @staticmethod
    def drawn(rng: np.random.Generator) -> Warming:
        """Return changes of the size that MEMS sensors have."""
        bias = np.array([rng.normal(0, size, 3) for size in (5e-4, 5e-6, 1e-7)])
        return Warming(bias, rng.normal(0, 1e-4, 3))

    def readings(self, unit: TrueTriads, force_g: Array, away_k: Array) -> Array:
        """Return readings (n, 3), g, at temperatures (n,) of a unit whose readings without a change are given."""
        force = np.linalg.solve(unit.force, (force_g - unit.force_bias_g).T).T
        return np.asarray(force_g + self._bias_g(away_k[:, None]) + away_k[:, None] * self.scale_factor * force)

    def unit_at(self, unit: TrueTriads, away_k: float) -> TrueTriads:
        """Return the unit at one temperature."""
        return replace(
            unit, force=unit.force + away_k * np.diag(self.scale_factor),
            force_bias_g=unit.force_bias_g + self._bias_g(np.full(1, away_k)),
        )  # fmt: skip

    def _bias_g(self, away_k: Array) -> Array:
        return np.asarray(sum(away_k**k * per for k, per in enumerate(self.bias_g, start=1)))


#: Directions up of twelve poses that no five degrees are between: the corners of an icosahedron.
GOLDEN = (1 + np.sqrt(5)) / 2
CORNERS = np.array([
    np.roll([0.0, a, b * GOLDEN], k) / np.hypot(1, GOLDEN) for k in range(3) for a in (1, -1) for b in (1, -1)
])  # fmt: skip


def _spread(rng: np.random.Generator, place: int) -> Array:
    """Return a pose with one of the corners up, or any direction after them, and any heading."""
    up = CORNERS[place] if place < len(CORNERS) else rng.normal(size=3)
    first = np.cross(up, rng.normal(size=3))
    z, x = up / np.linalg.norm(up), first / np.linalg.norm(first)
    return np.vstack([x, np.cross(z, x), z])


def _turn_to(at: Array, there: Array) -> Array:
    """Return the rotation vector (3,), in the body, from a pose to the next, by 0.8 rad and more."""
    between = at.T @ there
    values, vectors = np.linalg.eig(between)
    axis = np.real(vectors[:, int(np.argmin(np.abs(values - 1)))])
    angle = float(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1)))
    odd = between - between.T
    if axis @ np.array([odd[2, 1], odd[0, 2], odd[1, 0]]) < 0:
        axis = -axis
    return np.asarray(max(angle, 0.8) * axis)
